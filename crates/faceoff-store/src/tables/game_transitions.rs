//! Transitions of a game's state: queued, running, played, or ended without a result.

use crate::{column::Instant, error::Result};
use faceoff_types::GameId;
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Queues a game again, with a new job.
pub(crate) async fn requeue(
    connection: &mut SqliteConnection,
    id: GameId,
    job: Uuid,
) -> Result<()> {
    sqlx::query!(
        "UPDATE games SET state = 'queued', job_id = ?, attempt = NULL, ended_at = NULL, reason = NULL WHERE id = ?",
        Text(job),
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Marks a running game as queued: its job waits for a slot again.
pub(crate) async fn set_waiting(connection: &mut SqliteConnection, id: GameId) -> Result<()> {
    sqlx::query!(
        "UPDATE games SET state = 'queued', attempt = NULL WHERE id = ? AND state = 'running'",
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_running(
    connection: &mut SqliteConnection,
    id: GameId,
    attempt: u32,
) -> Result<()> {
    sqlx::query!(
        "UPDATE games SET state = 'running', attempt = ? WHERE id = ?",
        attempt,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Marks a game as played: the result of this attempt counts.
pub(crate) async fn set_played(
    connection: &mut SqliteConnection,
    id: GameId,
    attempt: u32,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE games SET state = 'played', attempt = ?, ended_at = ? WHERE id = ?",
        attempt,
        Instant(now),
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Why a game has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoResult {
    /// It was given up after platform faults.
    PlatformFailed,
    /// Its result was voided.
    Void,
    Cancelled,
}

/// Ends a game without a result.
pub(crate) async fn set_without_result(
    connection: &mut SqliteConnection,
    id: GameId,
    cause: NoResult,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    let state = match cause {
        NoResult::PlatformFailed => "broken",
        NoResult::Void => "void",
        NoResult::Cancelled => "cancelled",
    };
    sqlx::query!(
        "UPDATE games SET state = ?, attempt = NULL, ended_at = ?, reason = ? WHERE id = ?",
        state,
        Instant(now),
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}
