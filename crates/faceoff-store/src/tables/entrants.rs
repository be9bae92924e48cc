//! The table of entrants: the teams that take part in a tournament.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{DepartureKind, RoundNumber, TeamId, TeamName, TournamentId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A team of a tournament.
#[derive(Debug, Clone, PartialEq)]
pub struct Entrant {
    pub team: TeamId,
    /// The team's current name.
    pub name: TeamName,
    pub entered_at: Timestamp,
    /// Set if the team has left the running tournament.
    pub departure: Option<Departure>,
}

/// A team's departure from a running tournament.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Departure {
    pub kind: DepartureKind,
    /// The first round in which its games do not count.
    pub from_round: RoundNumber,
    /// When the team left.
    pub at: Timestamp,
    /// Public.
    pub reason: String,
}

/// The stored name of a kind of departure.
const fn stored_name(kind: DepartureKind) -> &'static str {
    match kind {
        DepartureKind::Withdrawn => "withdrawn",
        DepartureKind::Disqualified => "disqualified",
    }
}

/// All teams of a tournament, by name.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<Entrant>> {
    let rows = sqlx::query!(
        "SELECT e.team_id AS team, t.name, e.entered_at, e.left_as, e.from_round, e.left_at, e.left_for
         FROM entrants e JOIN teams t ON t.id = e.team_id WHERE e.tournament_id = ? ORDER BY t.name",
        tournament
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter()
        .map(|row| {
            let team = row.team;
            let departure = match (
                row.left_as.as_deref(),
                row.from_round,
                row.left_at,
                row.left_for,
            ) {
                (None, ..) => None,
                (Some(left_as), Some(from_round), Some(at), Some(reason)) => {
                    let damaged = || {
                        StoreError::Damaged(format!(
                            "entrant {team}: left as {left_as:?} from round {from_round}"
                        ))
                    };
                    let kinds = [DepartureKind::Withdrawn, DepartureKind::Disqualified];
                    let left_as = kinds.into_iter().find(|kind| stored_name(*kind) == left_as);
                    Some(Departure {
                        kind: left_as.ok_or_else(damaged)?,
                        from_round: from_round.try_into().map_err(|_| damaged())?,
                        at: at.0,
                        reason,
                    })
                }
                _ => {
                    return Err(StoreError::Damaged(format!(
                        "entrant {team}: its departure is incomplete"
                    )));
                }
            };
            Ok(Entrant {
                team,
                name: row.name,
                entered_at: row.entered_at.0,
                departure,
            })
        })
        .collect()
}

/// Removes a team from a tournament that has not begun.
pub(crate) async fn remove(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: TeamId,
) -> Result<()> {
    sqlx::query!(
        "DELETE FROM entrants WHERE tournament_id = ? AND team_id = ?",
        tournament,
        team
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn put(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: TeamId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "INSERT OR IGNORE INTO entrants (tournament_id, team_id, entered_at) VALUES (?, ?, ?)",
        tournament,
        team,
        Instant(now),
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_departure(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: TeamId,
    departure: &Departure,
) -> Result<()> {
    let (left_as, from_round) = (stored_name(departure.kind), departure.from_round.get());
    sqlx::query!(
        "UPDATE entrants SET left_as = ?, from_round = ?, left_at = ?, left_for = ?
         WHERE tournament_id = ? AND team_id = ?",
        left_as,
        from_round,
        Instant(departure.at),
        departure.reason,
        tournament,
        team,
    )
    .execute(connection)
    .await?;
    Ok(())
}
