//! Episode summaries, which boards and comparisons read in place of single outcomes. They are stored as soon as an
//! evaluation is scored or an ablation has ended, so that no page computes and stores them.

use crate::boxed_future;
use faceoff_scoring::EpisodeSummary;
use faceoff_store::Store;
use faceoff_types::{Competition, RunId};
use jiff::Timestamp;
use std::sync::Arc;

/// Stores the summaries of all ended runs that have none in the current format. A *run* is the episodes of a submission under
/// one plan. Failures are logged, and retried by the next call; until then readers compute the summary themselves.
#[boxed_future]
pub(crate) async fn store_missing(store: &Store, competition: &Arc<Competition>, now: Timestamp) {
    let missing = match store.unsummarised_runs(EpisodeSummary::VERSION).await {
        Ok(runs) => runs,
        Err(error) => {
            tracing::warn!(%error, "runs without an episode summary could not be found");
            return;
        }
    };
    for run in missing {
        if let Err(error) = store_summary(store, competition, run, now).await {
            tracing::warn!(%run, error = format!("{error:#}"), "an episode summary could not be stored");
        }
    }
}

async fn store_summary(
    store: &Store,
    competition: &Arc<Competition>,
    run: RunId,
    now: Timestamp,
) -> anyhow::Result<()> {
    let outcomes = store.outcomes(run).await?;
    let plan = store.run_plan(run).await?;
    let bounds = competition.tier_bounds(&plan.variation);
    // Takes some ten milliseconds, so it runs off the async threads.
    let competition = Arc::clone(competition);
    let summarise =
        move || EpisodeSummary::from_outcomes(&competition, &outcomes, &plan.tasks, bounds);
    let summary = tokio::task::spawn_blocking(summarise);
    let json = serde_json::to_string(&summary.await??)?;
    let stored = store.store_episode_summary(run, EpisodeSummary::VERSION, &json, now);
    Ok(stored.await?)
}
