//! The table of rounds of a tournament, with their draws: the pairs of teams that play each other.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
};
use faceoff_types::{RoundNumber, SubmissionId, TeamId, TournamentId};
use jiff::Timestamp;
use sqlx::SqliteConnection;
use std::collections::BTreeMap;

/// A started round.
#[derive(Debug, Clone, PartialEq)]
pub struct TournamentRound {
    /// From 1.
    pub number: RoundNumber,
    /// When it started; its submissions are fixed since then.
    pub started_at: Timestamp,
    /// When all of its games had ended for the first time.
    pub over_at: Option<Timestamp>,
    /// The teams of each group; empty if there are no groups.
    pub groups: Vec<Vec<TeamId>>,
    /// Teams without an opponent, by matchday.
    pub byes: Vec<RoundBye>,
    /// The submission of each team in this round.
    pub submissions: Vec<(TeamId, SubmissionId)>,
}

/// A team without an opponent on a matchday.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoundBye {
    /// From 1.
    pub matchday: u32,
    pub team: TeamId,
}

/// The draw of a round that is to be started. Pairs have the home team first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawnRound {
    /// The number after the last started round.
    pub number: RoundNumber,
    /// The teams of each group; empty if there are no groups.
    pub groups: Vec<Vec<TeamId>>,
    /// In the order of play.
    pub matchdays: Vec<DrawnMatchday>,
}

/// Games that can be played at the same time.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DrawnMatchday {
    pub games: Vec<[TeamId; 2]>,
    /// Teams without an opponent.
    pub byes: Vec<TeamId>,
}

/// All started rounds of a tournament, in order.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<TournamentRound>> {
    let mut submissions = BTreeMap::<u32, Vec<(TeamId, SubmissionId)>>::new();
    let rows = sqlx::query!(
        "SELECT round, team_id AS team, submission_id AS submission
         FROM round_submissions WHERE tournament_id = ? ORDER BY round, team_id",
        tournament
    )
    .fetch_all(&mut *connection)
    .await?;
    for row in rows {
        let round = submissions.entry(row.round).or_default();
        round.push((row.team, row.submission));
    }
    let rows = sqlx::query!(
        "SELECT number, started_at, over_at, groups, byes
         FROM rounds WHERE tournament_id = ? ORDER BY number",
        tournament
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter()
        .map(|row| {
            let number = RoundNumber::try_from(row.number).map_err(|error| {
                StoreError::Damaged(format!("a round of {tournament}: {error}"))
            })?;
            let byes = row.byes.0.into_iter();
            Ok(TournamentRound {
                number,
                started_at: row.started_at.0,
                over_at: row.over_at.map(|at| at.0),
                groups: row.groups.0,
                byes: byes
                    .map(|(matchday, team)| RoundBye { matchday, team })
                    .collect(),
                submissions: submissions.remove(&row.number).unwrap_or_default(),
            })
        })
        .collect()
}

/// Number of started rounds.
pub(crate) async fn count(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM rounds WHERE tournament_id = ?"#,
        tournament
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    round: &TournamentRound,
) -> Result<()> {
    let (id, number) = (tournament, round.number.get());
    let byes: Vec<(u32, TeamId)> = round
        .byes
        .iter()
        .map(|bye| (bye.matchday, bye.team))
        .collect();
    sqlx::query!(
        "INSERT INTO rounds (tournament_id, number, started_at, groups, byes) VALUES (?, ?, ?, ?, ?)",
        id,
        number,
        Instant(round.started_at),
        Json(&round.groups),
        Json(byes),
    )
    .execute(&mut *connection)
    .await?;
    for (team, submission) in &round.submissions {
        let (team, submission) = (*team, *submission);
        sqlx::query!(
            "INSERT INTO round_submissions (tournament_id, round, team_id, submission_id) VALUES (?, ?, ?, ?)",
            id,
            number,
            team,
            submission,
        )
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}

/// Records that all games of a round have ended; false if that was recorded before.
pub(crate) async fn set_ended(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    round: RoundNumber,
    now: Timestamp,
) -> Result<bool> {
    let updated = sqlx::query!(
        "UPDATE rounds SET over_at = ? WHERE tournament_id = ? AND number = ? AND over_at IS NULL",
        Instant(now),
        tournament,
        round.get(),
    )
    .execute(connection)
    .await?;
    Ok(updated.rows_affected() == 1)
}
