//! The table of validation runs, which check that a submission's agent starts, responds, and meets its time limits.

use crate::error::Result;
use faceoff_types::SubmissionId;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
    job: Uuid,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO validation_runs (submission_id, job_id) VALUES (?, ?)",
        submission,
        Text(job),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The submission that a job validates.
pub(crate) async fn of_job(
    connection: &mut SqliteConnection,
    job: Uuid,
) -> Result<Option<SubmissionId>> {
    let found = sqlx::query_scalar!(
        "SELECT submission_id AS id FROM validation_runs WHERE job_id = ?",
        Text(job)
    )
    .fetch_optional(connection)
    .await?;
    Ok(found)
}
