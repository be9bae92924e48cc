//! The episode summaries of played runs: made once from the stored outcomes, then kept in the database
//! and in memory. A board or an ablation never reads outcomes twice.

use crate::{boxed, problem::Problem};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::Store;
use faceoff_types::{Clock, RunId};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
};

/// Summaries held in memory; enough for the boards of several seasons of teams.
const CACHED: usize = 1000;

/// Summaries by run. A run that has been played never changes, so neither do they.
pub type RunSummaries = HashMap<RunId, Arc<EpisodeSummary>>;

#[derive(Debug)]
pub struct Summaries {
    store: Store,
    clock: Clock,
    cached: Mutex<RunSummaries>,
}

impl Summaries {
    pub fn new(store: Store, clock: Clock) -> Self {
        Self {
            store,
            clock,
            cached: Mutex::default(),
        }
    }

    /// The summary of one run that has been played.
    #[boxed]
    pub async fn of_run(&self, run: RunId) -> Result<Arc<EpisodeSummary>, Problem> {
        let summary = self.of(&[run]).await?.remove(&run);
        summary.ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
    }

    /// The summaries of `runs`, all of which have been played: one read for those that are not in memory.
    #[boxed]
    pub async fn of(&self, runs: &[RunId]) -> Result<RunSummaries, Problem> {
        let mut summaries = self.in_memory(runs);
        let missing = |summaries: &RunSummaries| -> Vec<RunId> {
            let missing = runs.iter().filter(|run| !summaries.contains_key(run));
            missing.copied().collect()
        };
        let unread = missing(&summaries);
        if !unread.is_empty() {
            let stored = self
                .store
                .episode_summaries(&unread, EpisodeSummary::VERSION)
                .await?;
            for (run, json) in stored {
                match serde_json::from_str(&json) {
                    Ok(summary) => self.keep(&mut summaries, run, summary),
                    Err(error) => {
                        tracing::warn!(%run, %error, "a stored summary is damaged; making it again");
                    }
                }
            }
            for run in missing(&summaries) {
                let summary = self.summarise(run).await?;
                self.keep(&mut summaries, run, summary);
            }
        }
        Ok(summaries)
    }

    async fn summarise(&self, run: RunId) -> Result<EpisodeSummary, Problem> {
        let outcomes = self.store.outcomes(run).await?;
        let bounds = self.store.run_variation(run).await?.tier_bounds;
        // some ten milliseconds of computation, which other requests need not wait for
        let summary = tokio::task::spawn_blocking(move || EpisodeSummary::of(&outcomes, &bounds))
            .await
            .map_err(Problem::internal)?
            .map_err(|error| Problem::internal(format_args!("run {run}: {error}")))?;
        let json = serde_json::to_string(&summary).map_err(Problem::internal)?;
        let kept =
            self.store
                .keep_episode_summary(run, EpisodeSummary::VERSION, &json, self.clock.now());
        // It can be made again, and memory has it: no page fails for want of a disk.
        if let Err(error) = kept.await {
            tracing::warn!(%run, %error, "a summary could not be kept");
        }
        Ok(summary)
    }

    fn in_memory(&self, runs: &[RunId]) -> RunSummaries {
        let cached = self.lock();
        let known = |run: &RunId| Some((*run, Arc::clone(cached.get(run)?)));
        runs.iter().filter_map(known).collect()
    }

    fn keep(&self, summaries: &mut RunSummaries, run: RunId, summary: EpisodeSummary) {
        let summary = Arc::new(summary);
        let mut cached = self.lock();
        if cached.len() >= CACHED {
            // rare, and all of it is in the database
            cached.clear();
        }
        cached.insert(run, Arc::clone(&summary));
        summaries.insert(run, summary);
    }

    fn lock(&self) -> MutexGuard<'_, RunSummaries> {
        // whoever panicked left whole entries behind
        self.cached
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
