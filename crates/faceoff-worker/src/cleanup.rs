//! Periodic removal of data that is no longer needed, and periodic storing of derived data.

use crate::{ablation_clips, boxed_future, episode_summaries};
use faceoff_scoring::EpisodeSummary;
use faceoff_store::{Store, StoreError};
use faceoff_types::{Clock, Competition};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// Upper bound of the time that writing an artifact takes.
const LONGEST_WRITE: SignedDuration = SignedDuration::from_hours(1);

/// Removes what is no longer needed: recordings, the shards of finished runs, datasets of dropped proposals, webhook deliveries, ended
/// credentials, half-written files, bundles that are invalid or of no submission, and files beyond the stages' retentions. Stores what is
/// missing: episode summaries, the joined clips of ablations, and sizes of datasets. Keeps the database's write-ahead log short.
///
/// Failures are logged, and retried by the next call.
#[boxed_future]
pub async fn clean_up(store: &Store, competition: &Arc<Competition>, clock: &Clock) {
    let now = clock.now();
    if let Err(error) = store.remove_old_recordings(now).await {
        tracing::warn!(%error, "old recordings could not be removed");
    }
    episode_summaries::store_missing(store, competition, now).await;
    if let Err(error) = clear_runs(store, now).await {
        tracing::warn!(%error, "finished runs could not be cleared");
    }
    if let Err(error) = store.remove_dropped_datasets(now).await {
        tracing::warn!(%error, "datasets of dropped proposals could not be removed");
    }
    if let Err(error) = store.delete_old_deliveries(now).await {
        tracing::warn!(%error, "old webhook deliveries could not be removed");
    }
    match store.delete_ended_credentials(now).await {
        Ok(0) => {}
        Ok(rows) => tracing::info!(
            rows,
            "tokens, sessions and invitations that ended long ago were removed"
        ),
        Err(error) => tracing::warn!(%error, "ended tokens and invitations could not be removed"),
    }
    ablation_clips::join_parts(store, competition.ideal_profile).await;
    apply_retentions(store, now).await;
    if let Err(error) = store.checkpoint().await {
        tracing::warn!(%error, "the database's write-ahead log could not be copied into the database");
    }
    // Files have the time of the system clock, which may have been set. So they are old only if both clocks say so.
    let written_before = clock.earliest() - LONGEST_WRITE;
    let abandoned = store.artifacts().remove_abandoned(written_before);
    if let Err(error) = abandoned.await {
        tracing::warn!(%error, "half-written artifacts could not be removed");
    }
    remove_invalid_bundles(store, now).await;
    match store.remove_orphaned_bundles(written_before).await {
        Ok(0) => {}
        Ok(bundles) => tracing::info!(bundles, "bundles without a submission were removed"),
        Err(error) => tracing::warn!(%error, "bundles without a submission could not be removed"),
    }
}

/// Applies the stages' retentions, and measures the remaining datasets.
async fn apply_retentions(store: &Store, now: Timestamp) {
    if let Err(error) = store.measure_datasets(now).await {
        tracing::warn!(%error, "datasets could not be measured");
    }
    match store.apply_retentions(now).await {
        Ok(removed) if removed.is_empty() => {}
        Ok(removed) => tracing::info!(
            datasets = removed.datasets,
            archives = removed.bundles,
            bytes = removed.bytes,
            "files were removed according to the stages' retentions"
        ),
        Err(error) => tracing::warn!(%error, "the stages' retentions could not be applied"),
    }
}

/// Removes the bundles of invalid submissions, and all but a team's last logs of them.
pub(crate) async fn remove_invalid_bundles(store: &Store, now: Timestamp) {
    match store.clean_up_failed_submissions(now).await {
        Ok(0) => {}
        Ok(bundles) => tracing::info!(bundles, "invalid bundles were removed"),
        Err(error) => tracing::warn!(%error, "invalid bundles could not be removed"),
    }
}

/// Clears finished runs: removes their shards from the database. Each run is cleared in its own transaction, so that a failure
/// does not affect the others. A *run* is the episodes of a submission under one plan, divided into shards.
async fn clear_runs(store: &Store, now: Timestamp) -> Result<(), StoreError> {
    for run in store.clearable_runs(EpisodeSummary::VERSION, now).await? {
        if let Err(error) = store.clear_run(run, now).await {
            tracing::warn!(%run, %error, "a finished run could not be cleared");
        }
    }
    Ok(())
}
