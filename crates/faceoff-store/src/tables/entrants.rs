//! The teams of a tournament.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{LeftAs, RoundNumber, TeamId, TeamName, TournamentId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// A team of a tournament.
#[derive(Debug, Clone, PartialEq)]
pub struct Entrant {
    pub team: TeamId,
    /// As it is called now.
    pub name: TeamName,
    /// Since when it is in it.
    pub entered_at: Timestamp,
    /// It plays no more in it, if so.
    pub left: Option<Leave>,
}

/// A team left in the middle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leave {
    pub left_as: LeftAs,
    /// The first round whose games with it do not count.
    pub from_round: RoundNumber,
    pub at: Timestamp,
    /// As everybody may read it.
    pub reason: String,
}

const fn word(left_as: LeftAs) -> &'static str {
    match left_as {
        LeftAs::Withdrawn => "withdrawn",
        LeftAs::Disqualified => "disqualified",
    }
}

/// All of a tournament, by name.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<Entrant>> {
    let id = Text(tournament);
    let rows = sqlx::query!(
        r#"SELECT e.team_id AS "team: Text<TeamId>", t.name AS "name: Text<TeamName>",
                  e.entered_at AS "entered_at: Instant", e.left_as, e.from_round AS "from_round: u32",
                  e.left_at AS "left_at: Instant", e.left_for
           FROM entrants e JOIN teams t ON t.id = e.team_id WHERE e.tournament_id = ? ORDER BY t.name"#,
        id
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter()
        .map(|row| {
            let team = row.team.0;
            let left = match (
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
                    let known = [LeftAs::Withdrawn, LeftAs::Disqualified];
                    let left_as = known.into_iter().find(|one| word(*one) == left_as);
                    Some(Leave {
                        left_as: left_as.ok_or_else(damaged)?,
                        from_round: from_round.try_into().map_err(|_| damaged())?,
                        at: at.0,
                        reason,
                    })
                }
                _ => return Err(StoreError::Damaged(format!("entrant {team}: left in part"))),
            };
            Ok(Entrant {
                team,
                name: row.name.0,
                entered_at: row.entered_at.0,
                left,
            })
        })
        .collect()
}

/// A team is not in it, and never was.
pub(crate) async fn remove(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: TeamId,
) -> Result<()> {
    let (tournament, team) = (Text(tournament), Text(team));
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
    let (tournament, team, now) = (Text(tournament), Text(team), Instant(now));
    sqlx::query!(
        "INSERT OR IGNORE INTO entrants (tournament_id, team_id, entered_at) VALUES (?, ?, ?)",
        tournament,
        team,
        now,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_left(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: TeamId,
    leave: &Leave,
) -> Result<()> {
    let (tournament, team, at) = (Text(tournament), Text(team), Instant(leave.at));
    let (left_as, from_round) = (word(leave.left_as), leave.from_round.get());
    sqlx::query!(
        "UPDATE entrants SET left_as = ?, from_round = ?, left_at = ?, left_for = ?
         WHERE tournament_id = ? AND team_id = ?",
        left_as,
        from_round,
        at,
        leave.reason,
        tournament,
        team,
    )
    .execute(connection)
    .await?;
    Ok(())
}
