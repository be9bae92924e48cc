use crate::{
    boxed,
    error::Result,
    store::Store,
    tables::days::{self, Day},
};
use faceoff_types::{StageDay, StageId};

impl Store {
    /// All days that had their cut, the newest cut first, each with how many of its evaluations are
    /// finished.
    #[boxed]
    pub async fn days(&self) -> Result<Vec<(Day, u32)>> {
        days::all(&mut *self.database.read.acquire().await?).await
    }

    /// Why each of the days that were missed was played later than on its date.
    #[boxed]
    pub async fn missed_days(&self) -> Result<Vec<(StageDay, String)>> {
        days::missed(&mut *self.database.read.acquire().await?).await
    }

    /// The days of a stage that had their cut and are not released, the earliest cut first.
    #[boxed]
    pub async fn days_under_way(&self, stage: StageId) -> Result<Vec<Day>> {
        days::unreleased(&mut *self.database.read.acquire().await?, stage).await
    }

    /// The last day of a stage that had its cut.
    #[boxed]
    pub async fn newest_day(&self, stage: StageId) -> Result<Option<Day>> {
        days::newest(&mut *self.database.read.acquire().await?, stage).await
    }
}
