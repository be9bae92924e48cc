//! Which versions of the program have opened the database.

use crate::{error::Result, program::Program};
use sqlx::SqliteConnection;

/// The last one; `None` of a database from before it was noted. Asked without the compile-time check, since the table may
/// be missing, or be a later version's.
pub(crate) async fn last(connection: &mut SqliteConnection) -> Result<Option<Program>> {
    let found: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'programs'",
    )
    .fetch_one(&mut *connection)
    .await?;
    if found == 0 {
        return Ok(None);
    }
    let row: Option<(String, i64)> =
        sqlx::query_as("SELECT version, schema FROM programs ORDER BY id DESC LIMIT 1")
            .fetch_optional(connection)
            .await?;
    Ok(row.map(|(version, schema)| Program { version, schema }))
}

/// Notes that this one has opened it.
pub(crate) async fn put(connection: &mut SqliteConnection, program: &Program) -> Result<()> {
    // Taken away first: who comes back after another version is the last one again.
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
