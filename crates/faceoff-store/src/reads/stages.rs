use crate::{
    boxed,
    error::Result,
    store::Store,
    tables::stages::{self, Revision, Stage},
};
use faceoff_types::StageId;
use jiff::Timestamp;

impl Store {
    /// All stages, the first to open first.
    #[boxed]
    pub async fn stages(&self) -> Result<Vec<Stage>> {
        stages::all(&mut *self.database.read.acquire().await?).await
    }

    /// The stage with this id.
    #[boxed]
    pub async fn stage(&self, id: StageId) -> Result<Stage> {
        stages::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// The stage that matters at `now`: of the open ones the last that opened, else the last that closed, else the
    /// first to open. `None` before the server has made one.
    #[boxed]
    pub async fn current_stage(&self, now: Timestamp) -> Result<Option<Stage>> {
        let stages = self.stages().await?;
        Ok(stages::current(&stages, now).cloned())
    }

    /// The rules that a stage has had, the first ones first.
    #[boxed]
    pub async fn stage_revisions(&self, stage: StageId) -> Result<Vec<Revision>> {
        stages::revisions(&mut *self.database.read.acquire().await?, stage).await
    }
}
