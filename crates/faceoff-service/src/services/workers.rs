//! Decisions about remote workers, which are processes on other machines that run jobs of this server.

use super::decision_preview::checked_reason;
use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_store::Actor;
use faceoff_types::WorkerName;

/// Bans a worker: its results are rejected from now on. Returns the number of its shards (parts of
/// unfinished evaluations) that are queued again.
#[boxed_future]
pub async fn ban_worker(
    app: &AppState,
    actor: Actor,
    worker: &WorkerName,
    reason: &str,
) -> Result<u32, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let requeued = app.store.ban_worker(actor, worker, reason, now).await?;
    app.live.workers.end_jobs_of(worker.as_str());
    tracing::info!(%worker, reason, requeued, "worker banned");
    Ok(requeued)
}

/// Lifts a worker's ban.
#[boxed_future]
pub async fn readmit_worker(
    app: &AppState,
    actor: Actor,
    worker: &WorkerName,
) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.readmit_worker(actor, worker, now).await?;
    tracing::info!(%worker, "worker readmitted");
    Ok(())
}
