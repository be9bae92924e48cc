//! Episode summaries of completed runs. A *run* is all episodes of one submission under the same conditions; its summary
//! condenses the outcomes of the episodes. The worker stores it when the run has ended; until then it is computed from the
//! outcomes. It is kept in memory, so that a board or an ablation reads it once.

use crate::{boxed_future, problem::Problem, shared_cache::SharedCache};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::Store;
use faceoff_types::{Competition, RunId};
use std::{collections::HashMap, sync::Arc};

/// Largest number of summaries in memory; enough for the boards of several seasons.
const MAX_CACHED: u64 = 1000;

/// Summaries by run. A completed run never changes, so neither does its summary.
pub type RunSummaries = HashMap<RunId, Arc<EpisodeSummary>>;

/// Loads summaries from memory or the database, or computes them. It stores none.
#[derive(Debug)]
pub struct Summaries {
    store: Store,
    competition: Arc<Competition>,
    cached: SharedCache<RunId, EpisodeSummary>,
}

impl Summaries {
    pub fn new(store: Store, competition: Arc<Competition>) -> Self {
        Self {
            store,
            competition,
            cached: SharedCache::with_entries(MAX_CACHED),
        }
    }

    /// The summary of one completed run.
    #[boxed_future]
    pub async fn load_run(&self, run: RunId) -> Result<Arc<EpisodeSummary>, Problem> {
        let summary = self.load(&[run]).await?.remove(&run);
        summary.ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
    }

    /// The summaries of completed runs: one database read for those that are not in memory.
    #[boxed_future]
    pub async fn load(&self, runs: &[RunId]) -> Result<RunSummaries, Problem> {
        let mut summaries = RunSummaries::new();
        for run in runs {
            if let Some(summary) = self.cached.cached(run).await {
                summaries.insert(*run, summary);
            }
        }
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
                    Ok(summary) => self.insert(&mut summaries, run, summary).await,
                    Err(error) => {
                        tracing::warn!(%run, %error, "a stored summary is damaged; computing it again");
                    }
                }
            }
            for run in missing(&summaries) {
                let summary = self.summarise(run).await?;
                self.insert(&mut summaries, run, summary).await;
            }
        }
        Ok(summaries)
    }

    async fn summarise(&self, run: RunId) -> Result<EpisodeSummary, Problem> {
        let outcomes = self.store.outcomes(run).await?;
        let plan = self.store.run_plan(run).await?;
        let bounds = self.competition.tier_bounds(&plan.variation);
        // Takes some ten milliseconds, so it runs off the threads that handle requests.
        let competition = Arc::clone(&self.competition);
        let summarise =
            move || EpisodeSummary::from_outcomes(&competition, &outcomes, &plan.tasks, bounds);
        tokio::task::spawn_blocking(summarise)
            .await
            .map_err(Problem::internal)?
            .map_err(|error| Problem::internal(format_args!("run {run}: {error}")))
    }

    async fn insert(&self, summaries: &mut RunSummaries, run: RunId, summary: EpisodeSummary) {
        let summary = Arc::new(summary);
        self.cached.insert(run, Arc::clone(&summary)).await;
        summaries.insert(run, summary);
    }
}
