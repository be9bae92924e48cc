use crate::{
    Store, StoreError,
    column::{Bytes32, Instant},
};
use faceoff_types::{TeamId, TeamName};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// A team.
#[derive(Debug, Clone, PartialEq)]
pub struct Team {
    /// Its id.
    pub id: TeamId,
    /// Its name on the board.
    pub name: TeamName,
    /// When it was invited.
    pub created_at: Timestamp,
}

struct TeamRow {
    id: Text<TeamId>,
    name: Text<TeamName>,
    created_at: Instant,
}

impl From<TeamRow> for Team {
    fn from(row: TeamRow) -> Self {
        Self {
            id: row.id.0,
            name: row.name.0,
            created_at: row.created_at.0,
        }
    }
}

/// `SELECT` of whole teams; the argument is what follows `FROM teams`.
macro_rules! select_teams {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            TeamRow,
            r#"SELECT id AS "id: Text<TeamId>", name AS "name: Text<TeamName>",
                      created_at AS "created_at: Instant"
               FROM teams "# + $tail
            $(, $argument)*
        )
    };
}

/// All teams, by name.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Team>, StoreError> {
    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?;
    Ok(teams.into_iter().map(Team::from).collect())
}

impl Store {
    /// Creates a team. `token_hash` is the hash of its bearer token; the token itself is never
    /// stored. [`StoreError::TeamNameTaken`] if the name exists, whatever its case.
    pub async fn create_team(
        &self,
        name: &TeamName,
        token_hash: [u8; 32],
        now: Timestamp,
    ) -> Result<Team, StoreError> {
        let (id, token_hash, now) = (Text(TeamId::new()), Bytes32(token_hash), Instant(now));
        let text = name.as_str();
        let mut tx = self.database.begin().await?;
        sqlx::query!(
            "INSERT INTO teams (id, name, token_hash, created_at) VALUES (?, ?, ?, ?)",
            id,
            text,
            token_hash,
            now,
        )
        .execute(&mut *tx)
        .await
        .map_err(|error| {
            if StoreError::is_duplicate(&error, "teams.name") {
                StoreError::TeamNameTaken(name.to_string())
            } else {
                token_error(error)
            }
        })?;
        let team = select_teams!("WHERE id = ?", id)
            .fetch_one(&mut *tx)
            .await?;
        tx.commit().await?;
        Ok(team.into())
    }

    /// The team with this id.
    pub async fn team(&self, id: TeamId) -> Result<Team, StoreError> {
        let id = Text(id);
        select_teams!("WHERE id = ?", id)
            .fetch_optional(&self.database.read)
            .await?
            .map(Team::from)
            .ok_or(StoreError::NotFound("team"))
    }

    /// The team whose token has this hash.
    pub async fn team_by_token_hash(
        &self,
        token_hash: [u8; 32],
    ) -> Result<Option<Team>, StoreError> {
        let token_hash = Bytes32(token_hash);
        let team = select_teams!("WHERE token_hash = ?", token_hash)
            .fetch_optional(&self.database.read)
            .await?;
        Ok(team.map(Team::from))
    }

    /// All teams, by name.
    pub async fn teams(&self) -> Result<Vec<Team>, StoreError> {
        all(&mut *self.database.read.acquire().await?).await
    }

    /// Replaces a lost token; the old one is void from now on.
    pub async fn set_team_token(&self, id: TeamId, token_hash: [u8; 32]) -> Result<(), StoreError> {
        let (id, token_hash) = (Text(id), Bytes32(token_hash));
        let mut tx = self.database.begin().await?;
        let done = sqlx::query!(
            "UPDATE teams SET token_hash = ? WHERE id = ?",
            token_hash,
            id
        )
        .execute(&mut *tx)
        .await
        .map_err(token_error)?;
        if done.rows_affected() == 0 {
            return Err(StoreError::NotFound("team"));
        }
        Ok(tx.commit().await?)
    }
}

fn token_error(error: sqlx::Error) -> StoreError {
    if StoreError::is_duplicate(&error, "teams.token_hash") {
        StoreError::Conflict("another team has this token: draw a new one".into())
    } else {
        error.into()
    }
}
