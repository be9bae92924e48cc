//! Board freezes: an organiser keeps the public boards of a stage as they are, for example before a ceremony.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{board_freezes, decision_records::DecisionRecord, stages},
};
use faceoff_types::StageId;
use jiff::Timestamp;

impl Store {
    /// Freezes the boards of a stage as they are at `now`, until they are unfrozen. Evaluation days continue, but
    /// results that finish later are not shown. [`StoreError::Conflict`] if the boards are frozen already.
    #[boxed_future]
    pub async fn freeze_boards(
        &self,
        actor: Actor,
        stage: StageId,
        reason: &str,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            stages::find(tx, stage).await?;
            if let Some(frozen) = board_freezes::find(tx, stage).await? {
                return StoreError::conflict(format!(
                    "the boards of the stage are frozen already, since {}",
                    frozen.at
                ));
            }
            let decision = DecisionRecord {
                at: now,
                reason: reason.to_owned(),
            };
            board_freezes::insert(tx, stage, &decision).await?;
            let reason = decision.reason;
            tx.record(Subject::Stage(stage), Event::BoardsFrozen { reason });
            Ok(())
        })
        .await
    }

    /// Unfreezes the boards of a stage: they show all results again. [`StoreError::Conflict`] if they are not frozen.
    #[boxed_future]
    pub async fn unfreeze_boards(
        &self,
        actor: Actor,
        stage: StageId,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            stages::find(tx, stage).await?;
            if board_freezes::find(tx, stage).await?.is_none() {
                return StoreError::conflict("the boards of the stage are not frozen");
            }
            board_freezes::remove(tx, stage).await?;
            tx.record(Subject::Stage(stage), Event::BoardsUnfrozen);
            Ok(())
        })
        .await
    }

    /// All stages with frozen boards, with time and reason.
    #[boxed_future]
    pub async fn frozen_boards(&self) -> Result<Vec<(StageId, DecisionRecord)>> {
        board_freezes::all(&mut *self.database.read.acquire().await?).await
    }

    /// Time and reason of a stage's board freeze; `None` if its boards are not frozen.
    #[boxed_future]
    pub async fn board_freeze(&self, stage: StageId) -> Result<Option<DecisionRecord>> {
        board_freezes::find(&mut *self.database.read.acquire().await?, stage).await
    }
}
