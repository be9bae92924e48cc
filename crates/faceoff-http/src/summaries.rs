//! The episode summaries of finished runs: made once from the stored outcomes, then kept in the
//! database.

use crate::{AppState, problem::Problem};
use faceoff_scoring::EpisodeSummary;
use faceoff_types::RunId;
use std::{collections::HashMap, sync::Arc};

/// Summaries held in memory; enough for the boards of several seasons of teams.
const CACHED: usize = 1000;

/// Summaries in memory. A finished run never changes, so neither do they.
#[derive(Debug, Default)]
pub(crate) struct SummaryCache(std::sync::Mutex<HashMap<RunId, Arc<EpisodeSummary>>>);

impl SummaryCache {
    fn get(&self, id: RunId) -> Option<Arc<EpisodeSummary>> {
        self.lock().get(&id).cloned()
    }

    fn put(&self, id: RunId, summary: &Arc<EpisodeSummary>) {
        let mut cached = self.lock();
        if cached.len() >= CACHED {
            // rare, and all of it is in the database
            cached.clear();
        }
        cached.insert(id, Arc::clone(summary));
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<RunId, Arc<EpisodeSummary>>> {
        // whoever panicked left whole entries behind
        self.0
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl AppState {
    /// The summary of a finished run's episodes.
    pub(crate) async fn summary(&self, run: RunId) -> Result<Arc<EpisodeSummary>, Problem> {
        let mut summaries = self.summaries_of([run]).await?;
        summaries
            .remove(&run)
            .ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
    }

    /// The summaries of these finished runs' episodes, in one query where they are stored.
    pub(crate) async fn summaries_of(
        &self,
        runs: impl IntoIterator<Item = RunId>,
    ) -> Result<HashMap<RunId, Arc<EpisodeSummary>>, Problem> {
        let mut found = HashMap::new();
        let mut missing = Vec::new();
        for run in runs {
            match self.summaries.get(run) {
                Some(summary) => drop(found.insert(run, summary)),
                None => missing.push(run),
            }
        }
        let version = EpisodeSummary::VERSION;
        let stored = self.store.episode_summaries(&missing, version).await?;
        for run in missing {
            let parsed = stored.get(&run).and_then(|json| {
                serde_json::from_str(json)
                    .inspect_err(|error| {
                        tracing::warn!(%run, %error, "a stored summary is damaged; making it again");
                    })
                    .ok()
            });
            let summary = Arc::new(match parsed {
                Some(summary) => summary,
                None => self.summarise(run).await?,
            });
            self.summaries.put(run, &summary);
            found.insert(run, summary);
        }
        Ok(found)
    }

    async fn summarise(&self, run: RunId) -> Result<EpisodeSummary, Problem> {
        let outcomes = self.store.outcomes(run).await?;
        // some ten milliseconds of computation, which other requests need not wait for
        let summary = tokio::task::spawn_blocking(move || EpisodeSummary::of(&outcomes))
            .await
            .map_err(Problem::internal)?
            .map_err(|error| Problem::internal(format_args!("run {run}: {error}")))?;
        let json = serde_json::to_string(&summary).map_err(Problem::internal)?;
        self.store
            .keep_episode_summary(run, EpisodeSummary::VERSION, &json, self.config.clock.now())
            .await?;
        Ok(summary)
    }
}
