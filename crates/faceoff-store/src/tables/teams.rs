use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
    tables::rulings::Ruling,
};
use faceoff_types::{TeamId, TeamName};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// Who takes part.
#[derive(Debug, Clone, PartialEq)]
pub struct Team {
    /// Stays when the team is renamed or gets another token.
    pub id: TeamId,
    /// As on the board; unique whatever the case of its letters.
    pub name: TeamName,
    /// When it was invited.
    pub created_at: Timestamp,
    /// It neither plays nor is ranked, if it is.
    pub disqualified: Option<Ruling>,
}

struct TeamRow {
    id: Text<TeamId>,
    name: Text<TeamName>,
    created_at: Instant,
    disqualified_at: Option<Instant>,
    disqualified_for: Option<String>,
}

impl From<TeamRow> for Team {
    fn from(row: TeamRow) -> Self {
        Self {
            id: row.id.0,
            name: row.name.0,
            created_at: row.created_at.0,
            disqualified: Ruling::of(row.disqualified_at, row.disqualified_for),
        }
    }
}

/// `SELECT` of whole teams; the argument is what follows `FROM teams`.
macro_rules! select_teams {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            TeamRow,
            r#"SELECT id AS "id: Text<TeamId>", name AS "name: Text<TeamName>",
                      created_at AS "created_at: Instant",
                      disqualified_at AS "disqualified_at: Instant", disqualified_for
               FROM teams "# + $tail
            $(, $argument)*
        )
    };
}

/// All teams, by name.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Team>> {
    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?;
    Ok(teams.into_iter().map(Team::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: TeamId) -> Result<Team> {
    let id = Text(id);
    select_teams!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Team::from)
        .ok_or(StoreError::NotFound("team"))
}

pub(crate) async fn by_token_hash(
    connection: &mut SqliteConnection,
    token_hash: [u8; 32],
) -> Result<Option<Team>> {
    let token_hash = Bytes32(token_hash);
    let team = select_teams!("WHERE token_hash = ?", token_hash)
        .fetch_optional(connection)
        .await?;
    Ok(team.map(Team::from))
}

/// [`StoreError::TeamNameTaken`] if the name exists, whatever its case.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    team: &Team,
    token_hash: [u8; 32],
) -> Result<()> {
    let (id, name) = (Text(team.id), Text(&team.name));
    let (token_hash, created_at) = (Bytes32(token_hash), Instant(team.created_at));
    sqlx::query!(
        "INSERT INTO teams (id, name, token_hash, created_at) VALUES (?, ?, ?, ?)",
        id,
        name,
        token_hash,
        created_at,
    )
    .execute(connection)
    .await
    .map_err(|error| {
        if StoreError::is_duplicate(&error, "teams.name") {
            StoreError::TeamNameTaken(team.name.to_string())
        } else {
            token_error(error)
        }
    })?;
    Ok(())
}

pub(crate) async fn set_token(
    connection: &mut SqliteConnection,
    id: TeamId,
    token_hash: [u8; 32],
) -> Result<()> {
    let (id, token_hash) = (Text(id), Bytes32(token_hash));
    let done = sqlx::query!(
        "UPDATE teams SET token_hash = ? WHERE id = ?",
        token_hash,
        id
    )
    .execute(connection)
    .await
    .map_err(token_error)?;
    match done.rows_affected() {
        0 => Err(StoreError::NotFound("team")),
        _ => Ok(()),
    }
}

/// Disqualifies a team, or reinstates it.
pub(crate) async fn set_disqualified(
    connection: &mut SqliteConnection,
    id: TeamId,
    ruling: Option<&Ruling>,
) -> Result<()> {
    let id = Text(id);
    let at = ruling.map(|ruling| Instant(ruling.at));
    let reason = ruling.map(|ruling| &ruling.reason);
    sqlx::query!(
        "UPDATE teams SET disqualified_at = ?, disqualified_for = ? WHERE id = ?",
        at,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Refuses what a disqualified team may not do.
pub(crate) async fn check_may_play(connection: &mut SqliteConnection, id: TeamId) -> Result<()> {
    match find(connection, id).await?.disqualified {
        Some(Ruling { at, reason }) => Err(StoreError::Disqualified { at, reason }),
        None => Ok(()),
    }
}

fn token_error(error: sqlx::Error) -> StoreError {
    if StoreError::is_duplicate(&error, "teams.token_hash") {
        StoreError::Conflict("another team has this token: draw a new one".into())
    } else {
        error.into()
    }
}
