//! Entries of evaluations: the submission, team and day of each, without its state and result.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{EvaluationId, RunId, StageDay, SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// The fixed data of an evaluation, without its state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) id: EvaluationId,
    pub(crate) submission: SubmissionId,
    pub(crate) team: TeamId,
    pub(crate) stage_day: StageDay,
    /// Revision of the stage's rules.
    pub(crate) revision: u32,
    pub(crate) run: RunId,
    /// The earlier evaluation that it repeats.
    pub(crate) rerun_of: Option<EvaluationId>,
}

/// The evaluation with this id.
pub(crate) async fn find(connection: &mut SqliteConnection, id: EvaluationId) -> Result<Entry> {
    let row = sqlx::query!(
        "SELECT submission_id AS submission, team_id AS team, stage_id AS stage, day, revision, run_id AS run,
                rerun_of
         FROM evaluations WHERE id = ?",
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("evaluation"))?;
    Ok(Entry {
        id,
        submission: row.submission,
        team: row.team,
        stage_day: StageDay {
            stage: row.stage,
            date: row.day.0,
        },
        revision: row.revision,
        run: row.run,
        rerun_of: row.rerun_of,
    })
}

/// Adds a queued evaluation. [`StoreError::Conflict`] if the team has another evaluation on that day which counts or is
/// open.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    entry: &Entry,
    now: Timestamp,
) -> Result<()> {
    let (id, submission, team) = (entry.id, entry.submission, entry.team);
    let (stage, day) = (entry.stage_day.stage, Text(entry.stage_day.date));
    let (run, now, rerun_of) = (entry.run, Instant(now), entry.rerun_of);
    sqlx::query!(
        "INSERT INTO evaluations (id, submission_id, team_id, stage_id, day, revision, run_id, created_at, state,
                                  rerun_of)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, 'open', ?)",
        id,
        submission,
        team,
        stage,
        day,
        entry.revision,
        run,
        now,
        rerun_of,
    )
    .execute(connection)
    .await
    .map_err(|error| {
        if StoreError::is_duplicate(&error, "evaluations.day") {
            StoreError::Conflict(format!(
                "the team has another evaluation on {} that counts or is running",
                entry.stage_day.date
            ))
        } else {
            error.into()
        }
    })?;
    Ok(())
}

/// Marks an evaluation as an extra one, beside the team's regular one of the day.
pub(crate) async fn set_extra(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    reason: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET extra_for = ? WHERE id = ?",
        reason,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Marks an evaluation as an extra one if the evaluation that it repeats is one.
pub(crate) async fn copy_extra(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    original: EvaluationId,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET extra_for = (SELECT o.extra_for FROM evaluations o WHERE o.id = ?) WHERE id = ?",
        original,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
