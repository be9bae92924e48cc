//! The table of divisions: the categories of teams, each with its own ranking.

use crate::error::{Result, StoreError};
use faceoff_types::DivisionName;
use sqlx::SqliteConnection;

/// All divisions, in the organisers' order.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<DivisionName>> {
    let names = sqlx::query_scalar!("SELECT name FROM divisions ORDER BY position")
        .fetch_all(connection)
        .await?;
    Ok(names)
}

/// The division of this name, with the organisers' spelling. [`StoreError::Conflict`] if there is none.
pub(crate) async fn check(
    connection: &mut SqliteConnection,
    name: &DivisionName,
) -> Result<DivisionName> {
    let divisions = all(connection).await?;
    let lowercase_name = name.as_str().to_lowercase();
    let found = divisions
        .iter()
        .find(|division| division.as_str().to_lowercase() == lowercase_name);
    found.cloned().ok_or_else(|| {
        let names: Vec<_> = divisions
            .iter()
            .map(|division| format!("“{division}”"))
            .collect();
        StoreError::Conflict(match names.is_empty() {
            true => format!("division: this season has no divisions, so leave out “{name}”"),
            false => format!("division: expected {}, got “{name}”", names.join(" or ")),
        })
    })
}

/// Number of teams in the division.
pub(crate) async fn teams_in(
    connection: &mut SqliteConnection,
    name: &DivisionName,
) -> Result<i64> {
    Ok(sqlx::query_scalar!(
        "SELECT COUNT(*) FROM teams WHERE division = ? COLLATE NOCASE",
        name.as_str()
    )
    .fetch_one(connection)
    .await?)
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    name: &DivisionName,
    position: u32,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO divisions (name, position) VALUES (?1, ?2)
         ON CONFLICT (name) DO UPDATE SET position = ?2",
        name.as_str(),
        position
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn remove(connection: &mut SqliteConnection, name: &DivisionName) -> Result<()> {
    let name = name.as_str();
    sqlx::query!("DELETE FROM divisions WHERE name = ?", name)
        .execute(connection)
        .await?;
    Ok(())
}
