//! Specifications of evaluations: the purpose, submission, team and day of each, without its state and result.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    tables::{evaluations::EvaluationPurpose, proposals::Proposal},
};
use faceoff_types::{EvaluationId, RunId, StageDay, SubmissionId, TeamId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// The fixed data of an evaluation, without its state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EvaluationSpec {
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

/// The evaluation of a day with this id, also a voided one.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<EvaluationSpec> {
    let row = sqlx::query!(
        r#"SELECT submission_id AS submission, team_id AS team, stage_id AS stage, day AS "day!", revision, run_id AS run,
                rerun_of
         FROM counting_evaluations WHERE id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("evaluation"))?;
    Ok(EvaluationSpec {
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

/// The error if the team has another evaluation on that day which counts or is open: [`StoreError::Conflict`].
fn day_taken_error(date: Date) -> impl FnOnce(sqlx::Error) -> StoreError {
    StoreError::if_duplicate("evaluations.day", move || {
        StoreError::Conflict(format!(
            "the team has another evaluation on {date} that counts or is running"
        ))
    })
}

/// Adds a queued evaluation that counts. [`StoreError::Conflict`] if the team has another one on that day which counts or
/// is open.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    spec: &EvaluationSpec,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO evaluations (id, purpose, submission_id, team_id, stage_id, day, revision, run_id, created_at,
                                  state, rerun_of)
         VALUES (?, 'counting', ?, ?, ?, ?, ?, ?, ?, 'open', ?)",
        spec.id,
        spec.submission,
        spec.team,
        spec.stage_day.stage,
        Text(spec.stage_day.date),
        spec.revision,
        spec.run,
        Instant(now),
        spec.rerun_of,
    )
    .execute(connection)
    .await
    .map_err(day_taken_error(spec.stage_day.date))?;
    Ok(())
}

/// Adds a queued evaluation of a proposal. `run` plays its episodes; `replaces` is the evaluation that it repeats, `None` in a trial.
pub(crate) async fn insert_proposed(
    connection: &mut SqliteConnection,
    proposal: &Proposal,
    (submission, team): (SubmissionId, TeamId),
    run: RunId,
    replaces: Option<EvaluationId>,
) -> Result<()> {
    let id = EvaluationId::new();
    let purpose = match proposal.kind.day() {
        None => EvaluationPurpose::Trial,
        Some(_) => EvaluationPurpose::Reevaluation,
    };
    sqlx::query!(
        "INSERT INTO evaluations (id, purpose, proposal_id, submission_id, team_id, stage_id, day, revision, run_id,
                                  created_at, state, rerun_of)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'open', ?)",
        id,
        purpose,
        proposal.id,
        submission,
        team,
        proposal.stage,
        proposal.kind.day().map(Text),
        proposal.revision,
        run,
        Instant(proposal.created_at),
        replaces,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Lets a re-evaluation that is over count from now on. It is an extra evaluation if the one that it repeats is.
/// [`StoreError::Conflict`] as for [`insert`].
pub(crate) async fn set_counting(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    date: Date,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations
         SET purpose = 'counting', finished_at = ?,
             extra_for = (SELECT o.extra_for FROM evaluations o WHERE o.id = evaluations.rerun_of)
         WHERE id = ?",
        Instant(now),
        id
    )
    .execute(connection)
    .await
    .map_err(day_taken_error(date))?;
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
