//! The table of board freezes: while a stage has one, its public boards do not show new results.

use crate::{column::Instant, error::Result, tables::decision_records::DecisionRecord};
use faceoff_types::StageId;
use sqlx::SqliteConnection;

/// Time and reason of the freeze of a stage's boards; `None` if they are not frozen.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<DecisionRecord>> {
    let row = sqlx::query!(
        "SELECT frozen_at AS at, reason FROM frozen_boards WHERE stage_id = ?",
        stage
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(|row| DecisionRecord {
        at: row.at.0,
        reason: row.reason,
    }))
}

/// All stages with frozen boards.
pub(crate) async fn all(
    connection: &mut SqliteConnection,
) -> Result<Vec<(StageId, DecisionRecord)>> {
    let rows = sqlx::query!("SELECT stage_id AS stage, frozen_at AS at, reason FROM frozen_boards")
        .fetch_all(connection)
        .await?;
    let decision = |at, reason| DecisionRecord { at, reason };
    Ok(rows
        .into_iter()
        .map(|row| (row.stage, decision(row.at.0, row.reason)))
        .collect())
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    stage: StageId,
    decision: &DecisionRecord,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO frozen_boards (stage_id, frozen_at, reason) VALUES (?, ?, ?)",
        stage,
        Instant(decision.at),
        decision.reason,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn remove(connection: &mut SqliteConnection, stage: StageId) -> Result<()> {
    sqlx::query!("DELETE FROM frozen_boards WHERE stage_id = ?", stage)
        .execute(connection)
        .await?;
    Ok(())
}
