//! Episode summaries of completed runs. A *run* is all episodes of one submission under the same conditions; its summary
//! condenses the outcomes of the episodes. It is computed once from the stored outcomes, then kept in the database and in
//! memory, so that a board or an ablation never reads outcomes twice.

use crate::{boxed, problem::Problem};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::Store;
use faceoff_types::{Clock, RunId};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
};

/// Largest number of summaries in memory; enough for the boards of several seasons.
const MAX_CACHED: usize = 1000;

/// Summaries by run. A completed run never changes, so neither does its summary.
pub type RunSummaries = HashMap<RunId, Arc<EpisodeSummary>>;

/// Loads summaries from memory or the database, or computes them.
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

    /// The summary of one completed run.
    #[boxed]
    pub async fn load_run(&self, run: RunId) -> Result<Arc<EpisodeSummary>, Problem> {
        let summary = self.load(&[run]).await?.remove(&run);
        summary.ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
    }

    /// The summaries of completed runs: one database read for those that are not in memory.
    #[boxed]
    pub async fn load(&self, runs: &[RunId]) -> Result<RunSummaries, Problem> {
        let mut summaries = self.cached(runs);
        let missing = |summaries: &RunSummaries| -> Vec<RunId> {
            let missing = runs.iter().filter(|run| !summaries.contains_key(run));
            missing.copied().collect()
        };
        let not_cached = missing(&summaries);
        if !not_cached.is_empty() {
            let stored = self
                .store
                .episode_summaries(&not_cached, EpisodeSummary::VERSION)
                .await?;
            for (run, json) in stored {
                match serde_json::from_str(&json) {
                    Ok(summary) => self.insert(&mut summaries, run, summary),
                    Err(error) => {
                        tracing::warn!(%run, %error, "a stored summary is damaged; computing it again");
                    }
                }
            }
            for run in missing(&summaries) {
                let summary = self.summarise(run).await?;
                self.insert(&mut summaries, run, summary);
            }
        }
        Ok(summaries)
    }

    async fn summarise(&self, run: RunId) -> Result<EpisodeSummary, Problem> {
        let outcomes = self.store.outcomes(run).await?;
        let tier_bounds = self.store.run_variation(run).await?.tier_bounds;
        // Takes some ten milliseconds, so it runs off the threads that handle requests.
        let summary = tokio::task::spawn_blocking(move || {
            EpisodeSummary::from_outcomes(&outcomes, &tier_bounds)
        })
        .await
        .map_err(Problem::internal)?
        .map_err(|error| Problem::internal(format_args!("run {run}: {error}")))?;
        let json = serde_json::to_string(&summary).map_err(Problem::internal)?;
        let stored =
            self.store
                .store_episode_summary(run, EpisodeSummary::VERSION, &json, self.clock.now());
        // The summary can be computed again, so a full disk is no reason to fail the request.
        if let Err(error) = stored.await {
            tracing::warn!(%run, %error, "a summary could not be stored");
        }
        Ok(summary)
    }

    fn cached(&self, runs: &[RunId]) -> RunSummaries {
        let cached = self.lock();
        let entry = |run: &RunId| Some((*run, Arc::clone(cached.get(run)?)));
        runs.iter().filter_map(entry).collect()
    }

    fn insert(&self, summaries: &mut RunSummaries, run: RunId, summary: EpisodeSummary) {
        let summary = Arc::new(summary);
        let mut cached = self.lock();
        if cached.len() >= MAX_CACHED {
            // This is rare, and all summaries are in the database.
            cached.clear();
        }
        cached.insert(run, Arc::clone(&summary));
        summaries.insert(run, summary);
    }

    fn lock(&self) -> MutexGuard<'_, RunSummaries> {
        // A panic cannot leave an incomplete entry behind.
        self.cached
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
