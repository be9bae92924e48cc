use crate::{
    boxed,
    error::Result,
    store::Store,
    tables::{
        archived,
        season::{self, Season},
        stages::Stage,
    },
};
use faceoff_types::{Seed, StageDay};
use std::collections::BTreeMap;

impl Store {
    /// The season with its secret.
    #[boxed]
    pub async fn season(&self) -> Result<Season> {
        season::read(&mut *self.database.read.acquire().await?).await
    }

    /// The seeds of these days of these stages, as far as they can be known here: an archive of a season that was not
    /// closed holds those of released days, and no secret.
    pub async fn day_seeds(
        &self,
        season: &Season,
        stages: &[Stage],
        days: impl Iterator<Item = StageDay>,
    ) -> Result<BTreeMap<StageDay, Seed>> {
        if self.archived().is_some() && season.closed_at.is_none() {
            return archived::seeds(&mut *self.database.read.acquire().await?).await;
        }
        let seed = |of: StageDay| {
            let stage = stages.iter().find(|stage| stage.id == of.stage)?;
            Some((of, stage.seed_label(of.date).seed(&season.secret)))
        };
        Ok(days.filter_map(seed).collect())
    }
}
