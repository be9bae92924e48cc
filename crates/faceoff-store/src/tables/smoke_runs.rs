//! The check of an upload: does it start, answer and keep time?

use crate::error::Result;
use faceoff_types::SubmissionId;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
    unit: Uuid,
) -> Result<()> {
    let (submission, unit) = (Text(submission), Text(unit));
    sqlx::query!(
        "INSERT INTO smoke_runs (submission_id, unit_id) VALUES (?, ?)",
        submission,
        unit,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Which submission a unit of work checks.
pub(crate) async fn of_unit(
    connection: &mut SqliteConnection,
    unit: Uuid,
) -> Result<Option<SubmissionId>> {
    let unit = Text(unit);
    let found = sqlx::query_scalar!(
        r#"SELECT submission_id AS "id: Text<SubmissionId>" FROM smoke_runs WHERE unit_id = ?"#,
        unit
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|id| id.0))
}
