//! The scoring of an evaluation whose shards are all committed.

use crate::error::Result;
use faceoff_types::EvaluationId;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
    unit: Uuid,
) -> Result<()> {
    let (evaluation, unit) = (Text(evaluation), Text(unit));
    sqlx::query!(
        "INSERT INTO finalisations (evaluation_id, unit_id) VALUES (?, ?)",
        evaluation,
        unit,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Which evaluation a unit of work scores.
pub(crate) async fn of_unit(
    connection: &mut SqliteConnection,
    unit: Uuid,
) -> Result<Option<EvaluationId>> {
    let unit = Text(unit);
    let found = sqlx::query_scalar!(
        r#"SELECT evaluation_id AS "id: Text<EvaluationId>" FROM finalisations WHERE unit_id = ?"#,
        unit
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|id| id.0))
}

/// The unit of work that scores an evaluation, once that is queued.
pub(crate) async fn unit_of(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
) -> Result<Option<Uuid>> {
    let evaluation = Text(evaluation);
    let found = sqlx::query_scalar!(
        r#"SELECT unit_id AS "id: Text<Uuid>" FROM finalisations WHERE evaluation_id = ?"#,
        evaluation
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|id| id.0))
}
