use crate::{
    Store, StoreError,
    column::{Bytes32, Instant},
    database::Database,
};
use faceoff_types::Seed;
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// The season: one per data folder.
#[derive(Debug, Clone)]
pub struct Season {
    /// The name shown to teams.
    pub name: String,
    /// All seeds derive from it; published when the season closes.
    pub secret: Seed,
    /// BLAKE3 of the secret's 32 bytes, 64 hexadecimal digits; published before the season opens, so
    /// that nobody can choose the episodes afterwards.
    pub commitment: String,
    /// When the data folder was first opened.
    pub created_at: Timestamp,
    /// When it was closed; `None` while it runs.
    pub closed_at: Option<Timestamp>,
}

/// When the season was closed.
pub(crate) async fn closed_at(
    connection: &mut SqliteConnection,
) -> Result<Option<Timestamp>, StoreError> {
    let closed = sqlx::query_scalar!(r#"SELECT closed_at AS "at: Instant" FROM season"#)
        .fetch_one(connection)
        .await?;
    Ok(closed.map(|at| at.0))
}

/// Refuses what a closed season no longer takes.
pub(crate) async fn check_open(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    match closed_at(connection).await? {
        Some(closed_at) => Err(StoreError::SeasonClosed { closed_at }),
        None => Ok(()),
    }
}

impl Store {
    /// The season.
    pub async fn season(&self) -> Result<Season, StoreError> {
        let row = sqlx::query!(
            r#"SELECT name, secret AS "secret: Bytes32", created_at AS "created_at: Instant",
                      closed_at AS "closed_at: Instant" FROM season"#
        )
        .fetch_optional(&self.database.read)
        .await?
        .ok_or_else(|| StoreError::Damaged("the season is missing".into()))?;
        Ok(Season {
            name: row.name,
            secret: Seed::from_bytes(row.secret.0),
            commitment: blake3::hash(&row.secret.0).to_string(),
            created_at: row.created_at.0,
            closed_at: row.closed_at.map(|at| at.0),
        })
    }

    /// Names the season.
    pub async fn name_season(&self, name: &str) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        sqlx::query!("UPDATE season SET name = ?", name)
            .execute(&mut *tx)
            .await?;
        Ok(tx.commit().await?)
    }

    /// Closes the season for good: nothing more is uploaded or evaluated, and its secret is public.
    /// [`StoreError::SeasonClosed`] if it is closed already, [`StoreError::Conflict`] while
    /// evaluations are under way.
    pub async fn close_season(&self, now: Timestamp) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        check_open(&mut tx).await?;
        let under_way = sqlx::query_scalar!(
            r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations
               WHERE state IN ('queued', 'running', 'finalising')"#
        )
        .fetch_one(&mut *tx)
        .await?;
        if under_way > 0 {
            return Err(StoreError::Conflict(format!(
                "{under_way} evaluations are queued or running, and closing the season publishes their \
                 seeds: wait until they are over, or cancel them"
            )));
        }
        let now = Instant(now);
        sqlx::query!("UPDATE season SET closed_at = ?", now)
            .execute(&mut *tx)
            .await?;
        Ok(tx.commit().await?)
    }
}

/// Gives a new data folder its season, with a secret from the operating system's generator.
pub(crate) async fn draw_secret_once(database: &Database) -> Result<(), StoreError> {
    let mut secret = [0; 32];
    getrandom::fill(&mut secret)
        .map_err(|error| StoreError::Database(sqlx::Error::Io(std::io::Error::other(error))))?;
    let secret = Bytes32(secret);
    let mut tx = database.begin().await?;
    sqlx::query!(
        "INSERT INTO season (id, name, secret, created_at)
         VALUES (1, 'Season 1', ?, CAST(unixepoch('subsec') * 1000 AS INTEGER))
         ON CONFLICT (id) DO NOTHING",
        secret,
    )
    .execute(&mut *tx)
    .await?;
    Ok(tx.commit().await?)
}
