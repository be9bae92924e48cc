//! Who may know which day's seed: one rule for the API and the pages.

use crate::{
    app::AppState,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{Actor, DaySeed};
use faceoff_types::Seed;
use jiff::civil;
use std::collections::{BTreeMap, BTreeSet};

/// How the seeds of some days stand.
#[derive(Debug)]
pub(crate) struct DaySeeds(BTreeMap<civil::Date, DaySeed>);

impl DaySeeds {
    /// The seed of an evaluation of `day`, if everybody may know it.
    pub(crate) fn public(&self, seed: Seed, day: civil::Date) -> Option<Seed> {
        (self.0.get(&day) == Some(&DaySeed::Public)).then_some(seed)
    }
}

impl AppState {
    /// How the seeds of these days stand. Looking releases nothing.
    pub(crate) async fn day_seeds(&self, days: BTreeSet<civil::Date>) -> Result<DaySeeds, Problem> {
        let seeds = self.store.day_seeds(days, self.config.clock.now()).await?;
        Ok(DaySeeds(seeds))
    }

    /// Before anything that carries the seed of `day` is handed out: notes its release.
    ///
    /// # Errors
    /// `NotYet` while evaluations of the day are under way.
    pub(crate) async fn release_day(&self, actor: Actor, day: civil::Date) -> Result<(), Problem> {
        let now = self.config.clock.now();
        match self.store.release_day(actor, day, now).await? {
            DaySeed::Secret { under_way } => Err(Problem::new(
                ProblemKind::NotYet,
                format!(
                    "not yet: {under_way} evaluations of {day} are still queued or running, and the \
                     dataset carries the seed of the episodes that they play; ask again when they \
                     are over"
                ),
            )
            .with("day", day.to_string())
            .with("under_way", under_way)),
            DaySeed::Releasable | DaySeed::Public => Ok(()),
        }
    }
}
