use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{freezes, rulings::Ruling, stages},
};
use faceoff_types::StageId;
use jiff::Timestamp;

impl Store {
    /// Has the boards of a stage show what they show at `now`, until they are unfrozen: days go on, and what is
    /// finished later is on none of them. [`StoreError::Conflict`] if they stand still already.
    #[boxed]
    pub async fn freeze_boards(
        &self,
        actor: Actor,
        stage: StageId,
        reason: &str,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            stages::find(tx, stage).await?;
            if let Some(frozen) = freezes::find(tx, stage).await? {
                return Err(StoreError::Conflict(format!(
                    "the boards of the stage are frozen already, since {}",
                    frozen.at
                )));
            }
            let ruling = Ruling {
                at: now,
                reason: reason.to_owned(),
            };
            freezes::insert(tx, stage, &ruling).await?;
            let reason = ruling.reason;
            tx.record(Subject::Stage(stage), Event::BoardsFrozen { reason });
            Ok(())
        })
        .await
    }

    /// Has the boards of a stage show everything again. [`StoreError::Conflict`] if they do.
    #[boxed]
    pub async fn unfreeze_boards(
        &self,
        actor: Actor,
        stage: StageId,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            stages::find(tx, stage).await?;
            if freezes::find(tx, stage).await?.is_none() {
                return Err(StoreError::Conflict(
                    "the boards of the stage are not frozen".into(),
                ));
            }
            freezes::remove(tx, stage).await?;
            tx.record(Subject::Stage(stage), Event::BoardsUnfrozen);
            Ok(())
        })
        .await
    }

    /// All stages whose boards stand still: since when, and why.
    #[boxed]
    pub async fn frozen_boards(&self) -> Result<Vec<(StageId, Ruling)>> {
        freezes::all(&mut *self.database.read.acquire().await?).await
    }

    /// Since when the boards of a stage stand still, and why; `None` if they do not.
    #[boxed]
    pub async fn boards_frozen(&self, stage: StageId) -> Result<Option<Ruling>> {
        freezes::find(&mut *self.database.read.acquire().await?, stage).await
    }
}
