//! What is done now and then, so that the data folder holds what is asked for and little else.

use crate::{ablation_clips, boxed};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Clearable, Store};
use jiff::{SignedDuration, Timestamp};

/// No artifact is under way longer than this.
const LONGEST_WRITE: SignedDuration = SignedDuration::from_hours(1);

/// Removes recordings that are no longer needed, what is left of runs that are long over and what kills left half
/// written, and keeps the database's log short. What fails is told and done by the next call.
#[boxed]
pub async fn tidy(store: &Store, now: Timestamp) {
    if let Err(error) = store.remove_old_recordings(now).await {
        tracing::warn!(%error, "old recordings could not be removed");
    }
    if let Err(error) = clear_runs(store, now).await {
        tracing::warn!(
            error = format!("{error:#}"),
            "runs that are over could not be cleared"
        );
    }
    if let Err(error) = store.remove_dropped_datasets(now).await {
        tracing::warn!(%error, "datasets of dropped proposals could not be removed");
    }
    if let Err(error) = store.forget_deliveries(now).await {
        tracing::warn!(%error, "what webhooks were told long ago could not be removed");
    }
    ablation_clips::join_parts(store).await;
    keep_as_said(store, now).await;
    if let Err(error) = store.checkpoint().await {
        tracing::warn!(%error, "the database's log could not be copied");
    }
    let abandoned = store.artifacts().remove_abandoned(now - LONGEST_WRITE);
    if let Err(error) = abandoned.await {
        tracing::warn!(%error, "half-written artifacts could not be removed");
    }
    remove_refused(store, now).await;
    match store.remove_orphaned_bundles(now - LONGEST_WRITE).await {
        Ok(0) => {}
        Ok(bundles) => tracing::info!(bundles, "bundles of no submission were removed"),
        Err(error) => tracing::warn!(%error, "bundles of no submission could not be removed"),
    }
}

/// Removes what the stages do not keep, and notes how large the rest is.
async fn keep_as_said(store: &Store, now: Timestamp) {
    if let Err(error) = store.measure_datasets(now).await {
        tracing::warn!(%error, "datasets could not be measured");
    }
    match store.apply_retentions(now).await {
        Ok(removed) if removed.is_nothing() => {}
        Ok(removed) => tracing::info!(
            datasets = removed.datasets,
            archives = removed.archives,
            bytes = removed.bytes,
            "what the stages' retentions do not keep was removed"
        ),
        Err(error) => tracing::warn!(%error, "what is not kept could not be removed"),
    }
}

/// Removes the bundles that were found invalid.
pub(crate) async fn remove_refused(store: &Store, now: Timestamp) {
    match store.remove_refused_bundles(now).await {
        Ok(0) => {}
        Ok(bundles) => tracing::info!(bundles, "refused bundles were removed"),
        Err(error) => tracing::warn!(%error, "refused bundles could not be removed"),
    }
}

/// Clears the runs that are over, each in a transaction of its own. One that cannot be keeps no other from it.
async fn clear_runs(store: &Store, now: Timestamp) -> anyhow::Result<()> {
    for clearable in store.clearable_runs(EpisodeSummary::VERSION, now).await? {
        let run = clearable.run;
        if let Err(error) = clear_run(store, clearable, now).await {
            tracing::warn!(%run, error = format!("{error:#}"), "a run that is over could not be cleared");
        }
    }
    Ok(())
}

/// Keeps first what its episodes come to.
async fn clear_run(store: &Store, clearable: Clearable, now: Timestamp) -> anyhow::Result<()> {
    let Clearable { run, wants_summary } = clearable;
    if wants_summary {
        let outcomes = store.outcomes(run).await?;
        let bounds = store.run_variation(run).await?.tier_bounds;
        let summary = tokio::task::spawn_blocking(move || EpisodeSummary::of(&outcomes, &bounds));
        let json = serde_json::to_string(&summary.await??)?;
        store
            .keep_episode_summary(run, EpisodeSummary::VERSION, &json, now)
            .await?;
    }
    Ok(store.clear_run(run, now).await?)
}
