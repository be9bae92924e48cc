//! The table of the season, which has one row.

use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
    tables::decision_records::DecisionRecord,
};
use faceoff_types::Seed;
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// The season: one per data folder.
#[derive(Debug, Clone)]
pub struct Season {
    /// Display name.
    pub name: String,
    /// All seeds derive from it; published when the season closes. In an archive of a season that was not closed it is
    /// zero and unused.
    pub secret: Seed,
    /// BLAKE3 of the secret's 32 bytes, 64 hexadecimal digits. It is published before the season opens, so
    /// that the episodes cannot be chosen afterwards.
    pub commitment: String,
    /// When the data folder was first opened.
    pub created_at: Timestamp,
    /// `None` while the season is open.
    pub closed_at: Option<Timestamp>,
    /// Set while the queue is paused: no job starts.
    pub queue_pause: Option<DecisionRecord>,
    /// Is registration of teams open to everyone?
    pub registration_open: bool,
}

pub(crate) async fn read(connection: &mut SqliteConnection) -> Result<Season> {
    let row = sqlx::query!(
        r#"SELECT name, secret, created_at,
                  closed_at, paused_at, paused_for,
                  takes_registrations,
                  (SELECT commitment FROM archived) AS "archived_commitment?: String"
           FROM season"#
    )
    .fetch_optional(connection)
    .await?
    .ok_or_else(|| StoreError::Damaged("the season is missing".into()))?;
    Ok(Season {
        name: row.name,
        secret: Seed::from_bytes(row.secret.0),
        commitment: match (row.archived_commitment, row.closed_at) {
            // an archive of a season that was not closed has no secret
            (Some(commitment), None) => commitment,
            _ => blake3::hash(&row.secret.0).to_string(),
        },
        created_at: row.created_at.0,
        closed_at: row.closed_at.map(|at| at.0),
        queue_pause: DecisionRecord::from_columns(row.paused_at, row.paused_for),
        registration_open: row.takes_registrations,
    })
}

/// The id of the season's competition, and the hash of what its scores depend on; `None` if no server has stored them.
pub(crate) async fn competition(
    connection: &mut SqliteConnection,
) -> Result<Option<(String, String)>> {
    let row = sqlx::query!("SELECT competition_id, competition_hash FROM season")
        .fetch_one(connection)
        .await?;
    Ok(row.competition_id.zip(row.competition_hash))
}

pub(crate) async fn set_competition(
    connection: &mut SqliteConnection,
    id: &str,
    hash: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE season SET competition_id = ?, competition_hash = ?",
        id,
        hash
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Refuses changes to a closed season.
pub(crate) async fn check_open(connection: &mut SqliteConnection) -> Result<()> {
    match read(connection).await?.closed_at {
        Some(closed_at) => Err(StoreError::SeasonClosed { closed_at }),
        None => Ok(()),
    }
}

/// Renames the season; false if it has that name already.
pub(crate) async fn rename(connection: &mut SqliteConnection, name: &str) -> Result<bool> {
    let renamed = sqlx::query!("UPDATE season SET name = ?1 WHERE name <> ?1", name)
        .execute(connection)
        .await?;
    Ok(renamed.rows_affected() > 0)
}

/// Is the queue paused? A separate query, because every claim needs it.
pub(crate) async fn is_paused(connection: &mut SqliteConnection) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM season WHERE paused_at IS NOT NULL) AS "paused!: bool""#
    )
    .fetch_one(connection)
    .await?)
}

/// Pauses the queue, or resumes it.
pub(crate) async fn set_paused(
    connection: &mut SqliteConnection,
    decision: Option<&DecisionRecord>,
) -> Result<()> {
    let at = decision.map(|decision| Instant(decision.at));
    let reason = decision.map(|decision| &decision.reason);
    sqlx::query!(
        "UPDATE season SET paused_at = ?, paused_for = ?",
        at,
        reason
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_registration_open(
    connection: &mut SqliteConnection,
    is_open: bool,
) -> Result<()> {
    sqlx::query!("UPDATE season SET takes_registrations = ?", is_open)
        .execute(connection)
        .await?;
    Ok(())
}

pub(crate) async fn close(connection: &mut SqliteConnection, now: Timestamp) -> Result<()> {
    sqlx::query!("UPDATE season SET closed_at = ?", Instant(now))
        .execute(connection)
        .await?;
    Ok(())
}

/// Creates the season of a new data folder, with a secret from the operating system's generator.
pub(crate) async fn create_once(connection: &mut SqliteConnection) -> Result<()> {
    let mut secret = [0; 32];
    getrandom::fill(&mut secret)
        .map_err(|error| StoreError::Database(sqlx::Error::Io(std::io::Error::other(error))))?;
    sqlx::query!(
        "INSERT INTO season (id, name, secret, created_at)
         VALUES (1, 'Season 1', ?, CAST(unixepoch('subsec') * 1000 AS INTEGER))
         ON CONFLICT (id) DO NOTHING",
        Bytes32(secret),
    )
    .execute(connection)
    .await?;
    Ok(())
}
