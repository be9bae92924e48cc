//! Queries of stages: the parts of the season, each with its own rules.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::stages::{self, Revision, Stage},
};
use faceoff_types::StageId;
use jiff::Timestamp;

impl Store {
    /// All stages, by opening time.
    #[boxed_future]
    pub async fn stages(&self) -> Result<Vec<Stage>> {
        stages::all(&mut *self.database.read.acquire().await?).await
    }

    /// The stage with this id.
    #[boxed_future]
    pub async fn stage(&self, id: StageId) -> Result<Stage> {
        stages::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// The current stage at `now`: the open one that opened last; if none is open, the one that closed last; if none has
    /// closed, the next to open. `None` before the server has created one.
    #[boxed_future]
    pub async fn current_stage(&self, now: Timestamp) -> Result<Option<Stage>> {
        let stages = self.stages().await?;
        Ok(stages::current(&stages, now).cloned())
    }

    /// All revisions of a stage's rules, the oldest first.
    #[boxed_future]
    pub async fn stage_revisions(&self, stage: StageId) -> Result<Vec<Revision>> {
        stages::revisions(&mut *self.database.read.acquire().await?, stage).await
    }
}
