//! The table of proposed evaluations: those of a proposal (a trial or a proposed re-evaluation). If the proposal is applied,
//! they become regular evaluations with the same ids.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::{
        evaluations::{EvaluationState, Failure},
        runs::RunState,
    },
};
use faceoff_types::{EvaluationId, EvaluationResult, ProposalId, RunId, SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// An evaluation of a proposal; it does not count.
#[derive(Debug, Clone, PartialEq)]
pub struct ProposedEvaluation {
    /// Also the id of the regular evaluation that it becomes if it is applied.
    pub id: EvaluationId,
    pub proposal: ProposalId,
    pub submission: SubmissionId,
    pub team: TeamId,
    /// The evaluation that it repeats; `None` in a trial.
    pub replaces: Option<EvaluationId>,
    pub run: RunId,
    /// When it was queued.
    pub created_at: Timestamp,
    pub state: EvaluationState,
}

/// A proposed evaluation with its run, without the run's progress.
pub(crate) struct ProposedEvaluationRow {
    id: EvaluationId,
    pub(crate) proposal: ProposalId,
    submission: SubmissionId,
    team: TeamId,
    replaces: Option<EvaluationId>,
    pub(crate) run: RunId,
    run_state: RunState,
    episodes_total: u32,
    created_at: Instant,
    state: String,
    finished_at: Option<Instant>,
    reason: Option<String>,
    dataset: Option<String>,
    dataset_blake3: Option<String>,
    result: Option<Json<EvaluationResult>>,
}

impl ProposedEvaluationRow {
    pub(crate) fn into_evaluation(self, episodes_done: u32) -> Result<ProposedEvaluation> {
        let id = self.id;
        let damaged = || {
            StoreError::Damaged(format!(
                "proposed evaluation {id}: {} and incomplete",
                self.state
            ))
        };
        let finished_at = self.finished_at.map(|at| at.0);
        let state = match (self.state.as_str(), finished_at) {
            ("open", None) => match self.run_state {
                RunState::Queued => EvaluationState::Queued,
                RunState::Running => EvaluationState::Running {
                    episodes_done: episodes_done.min(self.episodes_total),
                    episodes_total: self.episodes_total,
                },
                RunState::Complete => EvaluationState::Finalising,
                RunState::Stopped => return Err(damaged()),
            },
            ("finished", Some(finished_at)) => EvaluationState::Finished {
                finished_at,
                result: Box::new(self.result.ok_or_else(damaged)?.0),
                dataset: self.dataset.ok_or_else(damaged)?,
                dataset_blake3: self.dataset_blake3,
            },
            ("agent_failed", Some(finished_at)) => EvaluationState::AgentFailed { finished_at },
            ("platform_failed", Some(finished_at)) => EvaluationState::PlatformFailed {
                finished_at,
                reason: self.reason.ok_or_else(damaged)?,
            },
            ("cancelled", Some(finished_at)) => EvaluationState::Cancelled {
                finished_at,
                reason: self.reason.ok_or_else(damaged)?,
            },
            _ => return Err(damaged()),
        };
        Ok(ProposedEvaluation {
            id,
            proposal: self.proposal,
            submission: self.submission,
            team: self.team,
            replaces: self.replaces,
            run: self.run,
            created_at: self.created_at.0,
            state,
        })
    }
}

/// `SELECT` of proposed evaluations with their runs; the arguments are the SQL after the tables, and its argument.
macro_rules! select_proposed_evaluations {
    ($tail:literal, $argument:expr) => {
        sqlx::query_as!(
            ProposedEvaluationRow,
            r#"SELECT d.id, d.proposal_id AS proposal, d.submission_id AS submission, d.team_id AS team, d.replaces,
                      d.run_id AS run, r.state AS run_state,
                      r.episodes_per_task * json_array_length(r.tasks) AS "episodes_total!: u32", d.created_at, d.state,
                      d.finished_at, d.reason, d.dataset, d.dataset_blake3, d.result
               FROM proposed_evaluations d JOIN runs r ON r.id = d.run_id "# + $tail,
            $argument
        )
    };
}

/// The proposed evaluation with this id.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<ProposedEvaluationRow> {
    let row = select_proposed_evaluations!("WHERE d.id = ?", id).fetch_optional(connection);
    row.await?.ok_or(StoreError::NotFound("evaluation"))
}

/// The evaluations of a proposal, in the order in which they were queued.
pub(crate) async fn of_proposal(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<ProposedEvaluationRow>> {
    let evaluations = select_proposed_evaluations!(
        "WHERE d.proposal_id = ? ORDER BY d.created_at, d.id",
        proposal
    );
    Ok(evaluations.fetch_all(connection).await?)
}

/// The proposed evaluation that owns a run, if one does, and its proposal.
pub(crate) async fn of_run(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Option<(EvaluationId, ProposalId)>> {
    let found = sqlx::query!(
        "SELECT id, proposal_id AS proposal
         FROM proposed_evaluations WHERE run_id = ?",
        run
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|row| (row.id, row.proposal)))
}

/// The proposed evaluation that a job scores, with its run and its proposal.
pub(crate) async fn of_job(
    connection: &mut SqliteConnection,
    job: Uuid,
) -> Result<Option<(EvaluationId, RunId, ProposalId)>> {
    let job = Text(job);
    let found = sqlx::query!(
        "SELECT d.id, d.run_id AS run, d.proposal_id AS proposal
         FROM proposed_evaluation_scorings s JOIN proposed_evaluations d ON d.id = s.proposed_evaluation_id
         WHERE s.job_id = ?",
        job
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|row| (row.id, row.run, row.proposal)))
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    evaluation: &ProposedEvaluation,
) -> Result<()> {
    let (id, proposal, submission) = (evaluation.id, evaluation.proposal, evaluation.submission);
    let (team, replaces, run) = (evaluation.team, evaluation.replaces, evaluation.run);
    let created_at = Instant(evaluation.created_at);
    sqlx::query!(
        "INSERT INTO proposed_evaluations
             (id, proposal_id, submission_id, team_id, replaces, run_id, created_at, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, 'open')",
        id,
        proposal,
        submission,
        team,
        replaces,
        run,
        created_at,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores which job scores a proposed evaluation.
pub(crate) async fn insert_scoring(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    job: Uuid,
) -> Result<()> {
    let job = Text(job);
    sqlx::query!(
        "INSERT INTO proposed_evaluation_scorings (proposed_evaluation_id, job_id) VALUES (?, ?)",
        id,
        job
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The job that scores a proposed evaluation, or has scored it; `None` before that job is queued.
pub(crate) async fn job_of(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<Option<Uuid>> {
    let job = sqlx::query_scalar!(
        "SELECT job_id AS id FROM proposed_evaluation_scorings WHERE proposed_evaluation_id = ?",
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(job.map(|id| id.0))
}

pub(crate) async fn set_finished(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    result: &EvaluationResult,
    dataset: &str,
    dataset_blake3: &str,
    now: Timestamp,
) -> Result<()> {
    let (result, now) = (Json(result), Instant(now));
    sqlx::query!(
        "UPDATE proposed_evaluations SET state = 'finished', finished_at = ?, result = ?, dataset = ?,
                                         dataset_blake3 = ?
         WHERE id = ?",
        now,
        result,
        dataset,
        dataset_blake3,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_failed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    failure: Failure<'_>,
    now: Timestamp,
) -> Result<()> {
    let now = Instant(now);
    let (state, reason) = match failure {
        Failure::Agent => ("agent_failed", None),
        Failure::Platform(reason) => ("platform_failed", Some(reason)),
        Failure::Cancelled(reason) | Failure::NotPlayed(reason) => ("cancelled", Some(reason)),
    };
    sqlx::query!(
        "UPDATE proposed_evaluations SET state = ?, finished_at = ?, reason = ? WHERE id = ?",
        state,
        now,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Number of open evaluations, of one proposal or of all proposals.
pub(crate) async fn count_open(
    connection: &mut SqliteConnection,
    proposal: Option<ProposalId>,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM proposed_evaluations
           WHERE state = 'open' AND (?1 IS NULL OR proposal_id = ?1)"#,
        proposal
    )
    .fetch_one(connection)
    .await?)
}

/// Evaluations of proposals that were dropped until `dropped_until` and whose datasets are still stored, with the keys of
/// these datasets.
pub(crate) async fn dropped_with_datasets(
    connection: &mut SqliteConnection,
    dropped_until: Timestamp,
) -> Result<Vec<(EvaluationId, String)>> {
    let dropped_until = Instant(dropped_until);
    let rows = sqlx::query!(
        r#"SELECT d.id, d.dataset AS "dataset!"
           FROM proposals p JOIN proposed_evaluations d ON d.proposal_id = p.id
           WHERE p.outcome = 'dropped' AND p.settled_at <= ? AND d.dataset IS NOT NULL AND d.dataset_removed_at IS NULL"#,
        dropped_until
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id, row.dataset)).collect())
}

pub(crate) async fn set_dataset_removed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<()> {
    let now = Instant(now);
    sqlx::query!(
        "UPDATE proposed_evaluations SET dataset_removed_at = ? WHERE id = ?",
        now,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
