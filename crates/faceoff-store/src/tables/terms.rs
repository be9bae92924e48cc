//! The table of the terms of participation, which the organisers publish and a team's members must accept.

use crate::{column::Instant, error::Result};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A version of the terms of participation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terms {
    /// From 1; the newest version is in force.
    pub version: u32,
    /// When this version was published.
    pub since: Timestamp,
    pub text: String,
}

/// All versions, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Terms>> {
    let rows = sqlx::query!("SELECT version, since, text FROM terms ORDER BY version DESC")
        .fetch_all(connection)
        .await?;
    let terms = rows.into_iter().map(|row| Terms {
        version: row.version,
        since: row.since.0,
        text: row.text,
    });
    Ok(terms.collect())
}

/// The newest version's number, if there are terms.
pub(crate) async fn newest(connection: &mut SqliteConnection) -> Result<Option<u32>> {
    Ok(
        sqlx::query_scalar!(r#"SELECT MAX(version) AS "version: u32" FROM terms"#)
            .fetch_one(connection)
            .await?,
    )
}

pub(crate) async fn insert(connection: &mut SqliteConnection, terms: &Terms) -> Result<()> {
    sqlx::query!(
        "INSERT INTO terms (version, since, text) VALUES (?, ?, ?)",
        terms.version,
        Instant(terms.since),
        terms.text
    )
    .execute(connection)
    .await?;
    Ok(())
}
