//! The table of episode summaries: statistics of a run's episodes, for boards and comparisons. They are derived data and
//! can be recomputed.

use crate::{column::Json, error::Result};
use faceoff_types::RunId;
use sqlx::SqliteConnection;
use std::collections::HashMap;

/// The summaries of these runs that have the format `version`.
pub(crate) async fn of_runs(
    connection: &mut SqliteConnection,
    runs: &[RunId],
    version: u32,
) -> Result<HashMap<RunId, String>> {
    if runs.is_empty() {
        return Ok(HashMap::new());
    }
    let rows = sqlx::query!(
        "SELECT run_id AS run, summary FROM episode_summaries
         WHERE version = ? AND run_id IN (SELECT value FROM json_each(?))",
        version,
        Json(runs),
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.run, row.summary)).collect())
}

/// Stores a summary, replacing an earlier one.
pub(crate) async fn put(
    connection: &mut SqliteConnection,
    run: RunId,
    version: u32,
    summary: &str,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO episode_summaries (run_id, version, summary) VALUES (?, ?, ?)
         ON CONFLICT (run_id) DO UPDATE SET version = excluded.version, summary = excluded.summary",
        run,
        version,
        summary,
    )
    .execute(connection)
    .await?;
    Ok(())
}
