//! The table of attempts at games. A game is attempted until an attempt has a result, or the game is given up.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::games::GameCommit,
};
use faceoff_types::{GameId, Side};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// An attempt of a worker's slot at a game.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameAttempt {
    /// From 1.
    pub number: u32,
    pub worker: String,
    pub begun_at: Timestamp,
    /// `None` while the attempt is running.
    pub end: Option<AttemptEnd>,
}

/// The end of an attempt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttemptEnd {
    /// When the attempt ended.
    pub at: Timestamp,
    pub outcome: AttemptOutcome,
    /// Why it failed, was cancelled, or its result was voided; a text for the teams.
    pub reason: Option<String>,
}

/// Outcome of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx::Type)]
#[sqlx(rename_all = "snake_case")]
pub enum AttemptOutcome {
    /// It has a result, which counts unless it was voided.
    Played,
    /// It ended by a platform fault.
    #[sqlx(rename = "broken")]
    PlatformFailed,
    /// The slot was stopped, or ran out of disk space; the attempt does not count against the game.
    #[sqlx(rename = "given_back")]
    Released,
    /// The slot died: its lease expired or was ended.
    Lost,
    /// The game was cancelled meanwhile.
    #[sqlx(rename = "called_off")]
    Cancelled,
}

/// All attempts at a game, in order.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
    game: GameId,
) -> Result<Vec<GameAttempt>> {
    let rows = sqlx::query!(
        "SELECT number, worker, begun_at, ended_at, outcome, reason
         FROM game_attempts WHERE game_id = ? ORDER BY number",
        game
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| GameAttempt {
            number: row.number,
            worker: row.worker,
            begun_at: row.begun_at.0,
            end: row
                .ended_at
                .zip(row.outcome)
                .map(|(at, outcome)| AttemptEnd {
                    at: at.0,
                    outcome,
                    reason: row.reason,
                }),
        })
        .collect())
}

/// Adds an attempt of a slot that starts a game, and returns its number.
pub(crate) async fn begin(
    connection: &mut SqliteConnection,
    game: GameId,
    worker: &str,
    now: Timestamp,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"INSERT INTO game_attempts (game_id, number, worker, begun_at)
           VALUES (?1, (SELECT COALESCE(MAX(number), 0) + 1 FROM game_attempts WHERE game_id = ?1), ?2, ?3)
           RETURNING number AS "number!""#,
        game,
        worker,
        Instant(now),
    )
    .fetch_one(connection)
    .await?)
}

/// Names another slot as the worker of the running attempt.
pub(crate) async fn transfer(
    connection: &mut SqliteConnection,
    game: GameId,
    worker: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE game_attempts SET worker = ? WHERE game_id = ? AND ended_at IS NULL",
        worker,
        game,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends the running attempt at a game, if there is one.
pub(crate) async fn end(
    connection: &mut SqliteConnection,
    game: GameId,
    outcome: AttemptOutcome,
    reason: Option<&str>,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE game_attempts SET ended_at = ?, outcome = ?, reason = ? WHERE game_id = ? AND ended_at IS NULL",
        Instant(now),
        outcome,
        reason,
        game,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores the reason why the result of an attempt was voided.
pub(crate) async fn set_voided(
    connection: &mut SqliteConnection,
    game: GameId,
    attempt: u32,
    reason: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE game_attempts SET reason = ? WHERE game_id = ? AND number = ?",
        reason,
        game,
        attempt,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends the running attempt at a game with a result, and returns its number.
pub(crate) async fn commit(
    connection: &mut SqliteConnection,
    game: GameId,
    commit: &GameCommit,
    now: Timestamp,
) -> Result<u32> {
    let recording = commit.recording.as_ref();
    let (key, game_blake3) = (
        recording.map(|recording| &recording.key),
        recording.map(|recording| &recording.game_blake3),
    );
    let [home_blake3, away_blake3] =
        [0, 1].map(|side| recording.map(|recording| &recording.side_blake3[side]));
    let [home_log, away_log] = &commit.logs;
    sqlx::query_scalar!(
        r#"UPDATE game_attempts
           SET ended_at = ?, outcome = 'played', score = ?, recording = ?, game_blake3 = ?, home_blake3 = ?,
               away_blake3 = ?, home_log = ?, away_log = ?
           WHERE game_id = ? AND ended_at IS NULL RETURNING number AS "number!""#,
        Instant(now),
        Json(&commit.results),
        key,
        game_blake3,
        home_blake3,
        away_blake3,
        home_log,
        away_log,
        game,
    )
    .fetch_optional(connection)
    .await?
    .ok_or_else(|| StoreError::Damaged(format!("game {game}: no attempt is running")))
}

/// The tail of an agent's standard error in the attempt that counts.
pub(crate) async fn log(
    connection: &mut SqliteConnection,
    game: GameId,
    side: Side,
) -> Result<Option<String>> {
    let logs = sqlx::query!(
        "SELECT a.home_log, a.away_log FROM games g JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt
         WHERE g.id = ?",
        game
    )
    .fetch_optional(connection)
    .await?;
    Ok(logs.and_then(|logs| match side {
        Side::First => logs.home_log,
        Side::Second => logs.away_log,
    }))
}
