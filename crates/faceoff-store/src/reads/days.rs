use crate::{
    error::Result,
    store::Store,
    tables::days::{self, Day},
};
use faceoff_types::StageId;

impl Store {
    /// All days that had their cut, the newest cut first, each with how many of its evaluations are
    /// finished.
    pub async fn days(&self) -> Result<Vec<(Day, u32)>> {
        days::all(&mut *self.database.read.acquire().await?).await
    }

    /// The last day of a stage that had its cut.
    pub async fn newest_day(&self, stage: StageId) -> Result<Option<Day>> {
        days::newest(&mut *self.database.read.acquire().await?, stage).await
    }
}
