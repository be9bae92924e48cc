//! The episode summaries of finished evaluations: made once from the stored outcomes, then kept in the
//! database.

use crate::{AppState, problem::Problem};
use faceoff_scoring::EpisodeSummary;
use faceoff_types::EvaluationId;
use std::sync::Arc;

/// Summaries held in memory; enough for the boards of several seasons of teams.
const CACHED: usize = 1000;

/// Summaries in memory. A finished evaluation never changes, so neither do they.
#[derive(Debug, Default)]
pub(crate) struct SummaryCache(
    std::sync::Mutex<std::collections::HashMap<EvaluationId, Arc<EpisodeSummary>>>,
);

impl SummaryCache {
    fn get(&self, id: EvaluationId) -> Option<Arc<EpisodeSummary>> {
        self.lock().get(&id).cloned()
    }

    fn put(&self, id: EvaluationId, summary: &Arc<EpisodeSummary>) {
        let mut cached = self.lock();
        if cached.len() >= CACHED {
            // rare, and all of it is in the database
            cached.clear();
        }
        cached.insert(id, Arc::clone(summary));
    }

    fn lock(
        &self,
    ) -> std::sync::MutexGuard<'_, std::collections::HashMap<EvaluationId, Arc<EpisodeSummary>>>
    {
        // whoever panicked left whole entries behind
        self.0
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl AppState {
    /// The summary of a finished evaluation's episodes.
    pub(crate) async fn summary(&self, id: EvaluationId) -> Result<Arc<EpisodeSummary>, Problem> {
        if let Some(summary) = self.summaries.get(id) {
            return Ok(summary);
        }
        let stored = self
            .store
            .episode_summary(id, EpisodeSummary::VERSION)
            .await?;
        let stored = stored.and_then(|json| match serde_json::from_str(&json) {
            Ok(summary) => Some(summary),
            Err(error) => {
                tracing::warn!(evaluation = %id, %error, "a stored summary is damaged; making it again");
                None
            }
        });
        let summary = Arc::new(match stored {
            Some(summary) => summary,
            None => self.summarise(id).await?,
        });
        self.summaries.put(id, &summary);
        Ok(summary)
    }

    async fn summarise(&self, id: EvaluationId) -> Result<EpisodeSummary, Problem> {
        let outcomes = self.store.outcomes(id).await?;
        // some ten milliseconds of computation, which other requests need not wait for
        let summary = tokio::task::spawn_blocking(move || EpisodeSummary::of(&outcomes))
            .await
            .map_err(Problem::internal)?
            .map_err(|error| Problem::internal(format_args!("evaluation {id}: {error}")))?;
        let json = serde_json::to_string(&summary).map_err(Problem::internal)?;
        self.store
            .keep_episode_summary(id, EpisodeSummary::VERSION, &json)
            .await?;
        Ok(summary)
    }
}
