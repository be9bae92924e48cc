//! Queries of the season, and of the seeds that follow from its secret.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::{
        archive,
        season::{self, Season},
        stages::Stage,
    },
};
use faceoff_types::{Seed, StageDay};
use std::collections::BTreeMap;

impl Store {
    /// The season with its secret.
    #[boxed_future]
    pub async fn season(&self) -> Result<Season> {
        season::read(&mut *self.database.read.acquire().await?).await
    }

    /// The known seeds of these days of these stages. An archive of a season that was not closed has only the seeds of
    /// released days, and no secret.
    pub async fn day_seeds(
        &self,
        season: &Season,
        stages: &[Stage],
        days: impl Iterator<Item = StageDay>,
    ) -> Result<BTreeMap<StageDay, Seed>> {
        if self.archived_season().is_some() && season.closed_at.is_none() {
            return archive::seeds(&mut *self.database.read.acquire().await?).await;
        }
        let seed = |stage_day: StageDay| {
            let stage = stages.iter().find(|stage| stage.id == stage_day.stage)?;
            Some((
                stage_day,
                stage.seed_label(stage_day.date).seed(&season.secret),
            ))
        };
        Ok(days.filter_map(seed).collect())
    }
}
