//! How games go from one state to the next.

use crate::{column::Instant, error::Result};
use faceoff_types::GameId;
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Another unit is to play it.
pub(crate) async fn set_queued_again(
    connection: &mut SqliteConnection,
    id: GameId,
    unit: Uuid,
) -> Result<()> {
    let (id, unit) = (Text(id), Text(unit));
    sqlx::query!(
        "UPDATE games SET state = 'queued', unit_id = ?, attempt = NULL, ended_at = NULL, reason = NULL WHERE id = ?",
        unit,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Its unit waits for a slot again.
pub(crate) async fn set_waiting(connection: &mut SqliteConnection, id: GameId) -> Result<()> {
    let id = Text(id);
    sqlx::query!(
        "UPDATE games SET state = 'queued', attempt = NULL WHERE id = ? AND state = 'running'",
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// A slot plays it.
pub(crate) async fn set_running(
    connection: &mut SqliteConnection,
    id: GameId,
    attempt: u32,
) -> Result<()> {
    let id = Text(id);
    sqlx::query!(
        "UPDATE games SET state = 'running', attempt = ? WHERE id = ?",
        attempt,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The result of this attempt counts.
pub(crate) async fn set_played(
    connection: &mut SqliteConnection,
    id: GameId,
    attempt: u32,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE games SET state = 'played', attempt = ?, ended_at = ? WHERE id = ?",
        attempt,
        now,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Why a game has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoResult {
    Broken,
    Void,
    Cancelled,
}

/// It has no result.
pub(crate) async fn set_without_result(
    connection: &mut SqliteConnection,
    id: GameId,
    why: NoResult,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    let state = match why {
        NoResult::Broken => "broken",
        NoResult::Void => "void",
        NoResult::Cancelled => "cancelled",
    };
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE games SET state = ?, attempt = NULL, ended_at = ?, reason = ? WHERE id = ?",
        state,
        now,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}
