//! Every time that a slot began a game, whatever came of it: kept apart from results.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::games::GameCommit,
};
use faceoff_types::{GameId, Side};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// A time that a slot began a game.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameAttempt {
    /// From 1.
    pub number: u32,
    pub worker: String,
    pub begun_at: Timestamp,
    /// What came of it; none: it is under way.
    pub end: Option<AttemptEnd>,
}

/// What came of an attempt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttemptEnd {
    pub at: Timestamp,
    pub how: AttemptOutcome,
    /// What went wrong, or why it was called off or its result voided; in words for the teams.
    pub reason: Option<String>,
}

/// What came of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx::Type)]
#[sqlx(rename_all = "snake_case")]
pub enum AttemptOutcome {
    /// A result, which counts unless it was voided.
    Played,
    /// A fault of ours.
    Broken,
    /// The slot was asked to end, or found no room; the attempt does not count against the game.
    GivenBack,
    /// The slot died: its lease ran out, or was ended.
    Lost,
    /// The game was called off meanwhile.
    CalledOff,
}

/// All of a game, in order.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
    game: GameId,
) -> Result<Vec<GameAttempt>> {
    let id = Text(game);
    let rows = sqlx::query!(
        r#"SELECT number AS "number: u32", worker, begun_at AS "begun_at: Instant", ended_at AS "ended_at: Instant",
                  outcome AS "outcome: AttemptOutcome", reason
           FROM game_attempts WHERE game_id = ? ORDER BY number"#,
        id
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| GameAttempt {
            number: row.number,
            worker: row.worker,
            begun_at: row.begun_at.0,
            end: row.ended_at.zip(row.outcome).map(|(at, how)| AttemptEnd {
                at: at.0,
                how,
                reason: row.reason,
            }),
        })
        .collect())
}

/// A slot begins a game; the number of the attempt.
pub(crate) async fn begin(
    connection: &mut SqliteConnection,
    game: GameId,
    worker: &str,
    now: Timestamp,
) -> Result<u32> {
    let (id, now) = (Text(game), Instant(now));
    Ok(sqlx::query_scalar!(
        r#"INSERT INTO game_attempts (game_id, number, worker, begun_at)
           VALUES (?1, (SELECT COALESCE(MAX(number), 0) + 1 FROM game_attempts WHERE game_id = ?1), ?2, ?3)
           RETURNING number AS "number!: u32""#,
        id,
        worker,
        now,
    )
    .fetch_one(connection)
    .await?)
}

/// Another slot plays the attempt that is under way than the one that it was given out by.
pub(crate) async fn hand_over(
    connection: &mut SqliteConnection,
    game: GameId,
    worker: &str,
) -> Result<()> {
    let id = Text(game);
    sqlx::query!(
        "UPDATE game_attempts SET worker = ? WHERE game_id = ? AND ended_at IS NULL",
        worker,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends the attempt of a game that is under way, if one is.
pub(crate) async fn end(
    connection: &mut SqliteConnection,
    game: GameId,
    how: AttemptOutcome,
    reason: Option<&str>,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(game), Instant(now));
    sqlx::query!(
        "UPDATE game_attempts SET ended_at = ?, outcome = ?, reason = ? WHERE game_id = ? AND ended_at IS NULL",
        now,
        how,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Says why the result of an attempt counts no more.
pub(crate) async fn set_voided(
    connection: &mut SqliteConnection,
    game: GameId,
    attempt: u32,
    reason: &str,
) -> Result<()> {
    let id = Text(game);
    sqlx::query!(
        "UPDATE game_attempts SET reason = ? WHERE game_id = ? AND number = ?",
        reason,
        id,
        attempt,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends the attempt of a game that is under way with a result; its number.
pub(crate) async fn commit(
    connection: &mut SqliteConnection,
    game: GameId,
    commit: &GameCommit,
    now: Timestamp,
) -> Result<u32> {
    let (id, now, score) = (Text(game), Instant(now), Json(&commit.score));
    let recording = commit.recording.as_ref();
    let (key, whole) = (
        recording.map(|of| &of.key),
        recording.map(|of| &of.game_blake3),
    );
    let [home, away] = [0, 1].map(|side| recording.map(|of| &of.side_blake3[side]));
    let [home_log, away_log] = &commit.logs;
    sqlx::query_scalar!(
        r#"UPDATE game_attempts
           SET ended_at = ?, outcome = 'played', score = ?, recording = ?, game_blake3 = ?, home_blake3 = ?,
               away_blake3 = ?, home_log = ?, away_log = ?
           WHERE game_id = ? AND ended_at IS NULL RETURNING number AS "number!: u32""#,
        now,
        score,
        key,
        whole,
        home,
        away,
        home_log,
        away_log,
        id,
    )
    .fetch_optional(connection)
    .await?
    .ok_or_else(|| StoreError::Damaged(format!("game {game}: no attempt is under way")))
}

/// The end of an agent's standard error in the attempt that counts.
pub(crate) async fn log(
    connection: &mut SqliteConnection,
    game: GameId,
    side: Side,
) -> Result<Option<String>> {
    let id = Text(game);
    let logs = sqlx::query!(
        "SELECT a.home_log, a.away_log FROM games g JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt
         WHERE g.id = ?",
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(logs.and_then(|logs| match side {
        Side::First => logs.home_log,
        Side::Second => logs.away_log,
    }))
}
