//! The table of versions of Faceoff that have opened the database.

use crate::{error::Result, program::Program};
use sqlx::SqliteConnection;

/// The last version that opened the database; `None` if older versions did, which did not record it. The query is not
/// checked at compile time, because the table may be missing or from a later version.
pub(crate) async fn last(connection: &mut SqliteConnection) -> Result<Option<Program>> {
    let table_count: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'programs'",
    )
    .fetch_one(&mut *connection)
    .await?;
    if table_count == 0 {
        return Ok(None);
    }
    let row: Option<(String, i64)> =
        sqlx::query_as("SELECT version, schema FROM programs ORDER BY id DESC LIMIT 1")
            .fetch_optional(connection)
            .await?;
    Ok(row.map(|(version, schema)| Program { version, schema }))
}

/// Records that this version has opened the database.
pub(crate) async fn put(connection: &mut SqliteConnection, program: &Program) -> Result<()> {
    // The version's old row is deleted, so that its new row is the last one.
    sqlx::query!("DELETE FROM programs WHERE version = ?", program.version)
        .execute(&mut *connection)
        .await?;
    sqlx::query!(
        "INSERT INTO programs (id, version, schema) VALUES ((SELECT COALESCE(MAX(id), 0) + 1 FROM programs), ?, ?)",
        program.version,
        program.schema
    )
    .execute(connection)
    .await?;
    Ok(())
}
