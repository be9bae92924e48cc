//! Decisions about workers on other machines.

use super::deciding::checked_reason;
use crate::{app::AppState, boxed, problem::Problem};
use faceoff_store::{Actor, WorkerName};

/// Takes nothing of a worker any more; how many shards are played again.
#[boxed]
pub async fn ban_worker(
    app: &AppState,
    actor: Actor,
    worker: &WorkerName,
    reason: &str,
) -> Result<u32, Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    let again = app.store.ban_worker(actor, worker, reason, now).await?;
    tracing::info!(%worker, reason, again, "worker banned");
    Ok(again)
}

/// Takes a worker's ban back.
#[boxed]
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
