//! Queries of evaluation days. A day starts with its cutoff, and is released when its last evaluation has ended.

use crate::{
    boxed,
    error::Result,
    store::Store,
    tables::days::{self, Day},
};
use faceoff_types::{StageDay, StageId};

impl Store {
    /// All days whose cutoff has passed, the newest first, each with the number of its finished
    /// evaluations.
    #[boxed]
    pub async fn days(&self) -> Result<Vec<(Day, u32)>> {
        days::all(&mut *self.database.read.acquire().await?).await
    }

    /// The days that were started later than on their date, each with the reason.
    #[boxed]
    pub async fn missed_days(&self) -> Result<Vec<(StageDay, String)>> {
        days::missed(&mut *self.database.read.acquire().await?).await
    }

    /// The days of a stage whose cutoff has passed and that are not released, the earliest first.
    #[boxed]
    pub async fn unreleased_days(&self, stage: StageId) -> Result<Vec<Day>> {
        days::unreleased(&mut *self.database.read.acquire().await?, stage).await
    }

    /// The newest day of a stage whose cutoff has passed.
    #[boxed]
    pub async fn newest_day(&self, stage: StageId) -> Result<Option<Day>> {
        days::newest(&mut *self.database.read.acquire().await?, stage).await
    }
}
