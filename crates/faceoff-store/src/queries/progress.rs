//! Progress of runs: the number of episodes that are done.

use crate::{column::Json, error::Result};
use faceoff_types::RunId;
use sqlx::SqliteConnection;
use std::collections::HashMap;

/// Number of episodes done in each of these runs, as reported by the workers, in one query.
pub(crate) async fn of_runs(
    connection: &mut SqliteConnection,
    runs: &[RunId],
) -> Result<HashMap<RunId, u32>> {
    if runs.is_empty() {
        return Ok(HashMap::new());
    }
    let rows = sqlx::query!(
        r#"SELECT s.run_id AS run, SUM(j.progress) AS "episodes_done!: u32"
           FROM shards s JOIN jobs j ON j.id = s.job_id
           WHERE s.run_id IN (SELECT value FROM json_each(?)) GROUP BY s.run_id"#,
        Json(runs),
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.run, row.episodes_done))
        .collect())
}
