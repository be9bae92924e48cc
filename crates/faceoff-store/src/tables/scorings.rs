//! The table of scoring jobs: they score evaluations whose episodes have all been run.

use crate::error::Result;
use faceoff_types::EvaluationId;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
    job: Uuid,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO scorings (evaluation_id, job_id) VALUES (?, ?)",
        evaluation,
        Text(job),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The job that scores an evaluation; `None` before it is queued.
pub(crate) async fn job_of(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
) -> Result<Option<Uuid>> {
    let found = sqlx::query_scalar!(
        "SELECT job_id AS id FROM scorings WHERE evaluation_id = ?",
        evaluation
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|id| id.0))
}
