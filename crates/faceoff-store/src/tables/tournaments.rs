//! The table of tournaments: games among teams in rounds. The format in a tournament's rules says which teams play each other in a round.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::decision_records::DecisionRecord,
};
use faceoff_types::{
    StageId, StageName, SubmissionId, TournamentId, TournamentRules, TournamentSettings,
};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A tournament: rounds of games among teams.
#[derive(Debug, Clone, PartialEq)]
pub struct Tournament {
    /// Part of its URLs.
    pub id: TournamentId,
    /// Number in its season, from 1; its seeds derive from it.
    pub number: u32,
    /// Unique regardless of case. Tournaments have the same type of name as stages.
    pub name: StageName,
    pub created_at: Timestamp,
    /// The stage whose tiers (grades of its results) selected the first entrants, if any.
    pub stage: Option<StageId>,
    /// Everything that results depend on; fixed from the first round on.
    pub rules: TournamentRules,
    /// Everything that results do not depend on.
    pub settings: TournamentSettings,
    /// The organisers' agent, the opponent in test games.
    pub baseline: Option<SubmissionId>,
    /// Set while the tournament is paused: no game starts.
    pub paused: Option<DecisionRecord>,
    /// Set once the tournament is closed: then it cannot be changed.
    pub closed_at: Option<Timestamp>,
}

struct TournamentRow {
    id: TournamentId,
    number: u32,
    name: StageName,
    created_at: Instant,
    stage: Option<StageId>,
    rules: Json<TournamentRules>,
    settings: Json<TournamentSettings>,
    baseline: Option<SubmissionId>,
    paused_at: Option<Instant>,
    paused_for: Option<String>,
    closed_at: Option<Instant>,
}

impl From<TournamentRow> for Tournament {
    fn from(row: TournamentRow) -> Self {
        Self {
            id: row.id,
            number: row.number,
            name: row.name,
            created_at: row.created_at.0,
            stage: row.stage,
            rules: row.rules.0,
            settings: row.settings.0,
            baseline: row.baseline,
            paused: DecisionRecord::from_columns(row.paused_at, row.paused_for),
            closed_at: row.closed_at.map(|at| at.0),
        }
    }
}

/// `SELECT` of tournaments; the argument is the SQL after `FROM tournaments`.
macro_rules! select_tournaments {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            TournamentRow,
            "SELECT id, number, name, created_at, stage_id AS stage, rules, settings, baseline_id AS baseline,
                    paused_at, paused_for, closed_at
             FROM tournaments " + $tail
            $(, $argument)*
        )
    };
}

/// All tournaments, the oldest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Tournament>> {
    let rows = select_tournaments!("ORDER BY number")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Tournament::from).collect())
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: TournamentId,
) -> Result<Tournament> {
    select_tournaments!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Tournament::from)
        .ok_or(StoreError::NotFound("tournament"))
}

/// A tournament that can be changed. [`StoreError::Conflict`] if it is closed.
pub(crate) async fn find_open(
    connection: &mut SqliteConnection,
    id: TournamentId,
) -> Result<Tournament> {
    let tournament = find(connection, id).await?;
    match tournament.closed_at {
        None => Ok(tournament),
        Some(at) => StoreError::conflict(format!(
            "the tournament was closed on {}: it cannot be changed any more",
            at.strftime("%Y-%m-%d at %H:%M UTC")
        )),
    }
}

/// The number of the season's next tournament, from 1.
pub(crate) async fn next_number(connection: &mut SqliteConnection) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COALESCE(MAX(number), 0) + 1 AS "number!: u32" FROM tournaments"#
    )
    .fetch_one(connection)
    .await?)
}

/// Adds a tournament. [`StoreError::TournamentNameTaken`] if another tournament has its name.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    tournament: &Tournament,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO tournaments (id, number, name, created_at, stage_id, rules, settings) VALUES (?, ?, ?, ?, ?, ?, ?)",
        tournament.id,
        tournament.number,
        tournament.name.as_str(),
        Instant(tournament.created_at),
        tournament.stage,
        Json(&tournament.rules),
        Json(&tournament.settings),
    )
    .execute(connection)
    .await
    .map_err(name_error(&tournament.name))?;
    Ok(())
}

/// Stores all changeable fields of a tournament. [`StoreError::TournamentNameTaken`] if another tournament has its name.
pub(crate) async fn update(
    connection: &mut SqliteConnection,
    tournament: &Tournament,
) -> Result<()> {
    let paused_at = tournament.paused.as_ref().map(|paused| Instant(paused.at));
    let paused_for = tournament.paused.as_ref().map(|paused| &paused.reason);
    sqlx::query!(
        "UPDATE tournaments SET name = ?, rules = ?, settings = ?, baseline_id = ?, paused_at = ?, paused_for = ?,
                closed_at = ? WHERE id = ?",
        tournament.name.as_str(),
        Json(&tournament.rules),
        Json(&tournament.settings),
        tournament.baseline,
        paused_at,
        paused_for,
        tournament.closed_at.map(Instant),
        tournament.id,
    )
    .execute(connection)
    .await
    .map_err(name_error(&tournament.name))?;
    Ok(())
}

/// The store's error for a failed write of a tournament's name.
fn name_error(name: &StageName) -> impl FnOnce(sqlx::Error) -> StoreError {
    StoreError::if_duplicate("tournaments.name", || {
        StoreError::TournamentNameTaken(name.to_string())
    })
}
