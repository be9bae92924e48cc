//! Entries of evaluations: the submission, team and day of each, without its state and result.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{EvaluationId, RunId, StageDay, StageId, SubmissionId, TeamId};
use jiff::{Timestamp, civil::Date};
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
    let id_text = Text(id);
    let row = sqlx::query!(
        r#"SELECT submission_id AS "submission: Text<SubmissionId>", team_id AS "team: Text<TeamId>",
                  stage_id AS "stage: Text<StageId>", day AS "day: Text<Date>", revision AS "revision: u32",
                  run_id AS "run: Text<RunId>",
                  rerun_of AS "rerun_of: Text<EvaluationId>"
           FROM evaluations WHERE id = ?"#,
        id_text
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("evaluation"))?;
    Ok(Entry {
        id,
        submission: row.submission.0,
        team: row.team.0,
        stage_day: StageDay {
            stage: row.stage.0,
            date: row.day.0,
        },
        revision: row.revision,
        run: row.run.0,
        rerun_of: row.rerun_of.map(|id| id.0),
    })
}

/// Adds a queued evaluation. [`StoreError::Conflict`] if the team has another evaluation on that day which counts or is
/// open.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    entry: &Entry,
    now: Timestamp,
) -> Result<()> {
    let (id, submission, team) = (Text(entry.id), Text(entry.submission), Text(entry.team));
    let (stage, day) = (Text(entry.stage_day.stage), Text(entry.stage_day.date));
    let (run, now, rerun_of) = (Text(entry.run), Instant(now), entry.rerun_of.map(Text));
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
    let id = Text(id);
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
    let (id, original) = (Text(id), Text(original));
    sqlx::query!(
        "UPDATE evaluations SET extra_for = (SELECT o.extra_for FROM evaluations o WHERE o.id = ?) WHERE id = ?",
        original,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
