//! Queries of evaluation days. A day starts with its cutoff, and is released when its last evaluation has ended.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::{
        days::{self, Day},
        stages::Stage,
    },
};
use faceoff_types::{StageDay, StageId};
use jiff::{Timestamp, civil::Date};

impl Store {
    /// All days whose cutoff has passed, the newest first, each with the number of its finished
    /// evaluations.
    #[boxed_future]
    pub async fn days(&self) -> Result<Vec<(Day, u32)>> {
        days::all(&mut *self.database.read.acquire().await?).await
    }

    /// The days that were started later than on their date, each with the reason.
    #[boxed_future]
    pub async fn missed_days(&self) -> Result<Vec<(StageDay, String)>> {
        days::missed(&mut *self.database.read.acquire().await?).await
    }

    /// The days of a stage whose cutoff has passed and that are not released, the earliest first.
    #[boxed_future]
    pub async fn unreleased_days(&self, stage: StageId) -> Result<Vec<Day>> {
        days::unreleased(&mut *self.database.read.acquire().await?, stage).await
    }

    /// The newest day of a stage whose cutoff has passed.
    #[boxed_future]
    pub async fn newest_day(&self, stage: StageId) -> Result<Option<Day>> {
        days::newest(&mut *self.database.read.acquire().await?, stage).await
    }

    /// The newest day of a stage after the current date, if the schedule waits for its date to pass: it was started when a
    /// clock was ahead, and has evaluations that are open or count.
    #[boxed_future]
    pub async fn future_day(&self, stage: &Stage, now: Timestamp) -> Result<Option<Day>> {
        let today = stage.day(now).date;
        let mut connection = self.database.read.acquire().await?;
        let newest = days::newest_blocking(&mut connection, stage.id, today).await?;
        Ok(newest.filter(|day| day.stage_day.date > today))
    }

    /// The date of the stage's next day, if it has one, and its scheduled cutoff, as
    /// [`Stage::next_cutoff`]. Dates that had a cutoff are left out.
    #[boxed_future]
    pub async fn next_cutoff(
        &self,
        stage: &Stage,
        now: Timestamp,
    ) -> Result<Option<(Date, Option<Timestamp>)>> {
        let today = stage.day(now).date;
        let mut connection = self.database.read.acquire().await?;
        let newest = days::newest_blocking(&mut connection, stage.id, today).await?;
        let mut newest = newest.map(|day| day.stage_day.date);
        loop {
            let next = stage.next_cutoff(newest, now);
            let Some((date, _)) = next else {
                return Ok(None);
            };
            // A future day of which nothing counts has been started, and its seed is public.
            let stage_day = StageDay {
                stage: stage.id,
                date,
            };
            if !days::exists(&mut connection, stage_day).await? {
                return Ok(next);
            }
            newest = Some(date);
        }
    }
}
