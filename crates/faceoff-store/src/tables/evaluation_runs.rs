//! Evaluations as their jobs need them: the run, and the proposal of those that do not count.

use crate::error::{Result, StoreError};
use faceoff_types::{EvaluationId, ProposalId, RunId};
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// An evaluation as its jobs need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct EvaluationRun {
    pub(crate) id: EvaluationId,
    pub(crate) run: RunId,
    /// The proposal that it belongs to, while it does not count.
    pub(crate) proposal: Option<ProposalId>,
}

/// `SELECT` of evaluations as their jobs need them; the arguments are the condition and its argument.
macro_rules! select_runs {
    ($condition:literal, $argument:expr) => {
        sqlx::query_as!(
            EvaluationRun,
            r#"SELECT e.id, e.run_id AS run,
                      CASE WHEN e.purpose <> 'counting' THEN e.proposal_id END AS "proposal: ProposalId"
               FROM evaluations e WHERE "# + $condition,
            $argument
        )
    };
}

/// The evaluation with this id as its jobs need it.
pub(crate) async fn run_of(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<EvaluationRun> {
    select_runs!("e.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("evaluation"))
}

/// The evaluation that owns a run, if one does.
pub(crate) async fn of_run(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Option<EvaluationRun>> {
    let found = select_runs!("e.run_id = ?", run).fetch_optional(connection);
    Ok(found.await?)
}

/// The evaluation that a job scores.
pub(crate) async fn of_scoring_job(
    connection: &mut SqliteConnection,
    job: Uuid,
) -> Result<Option<EvaluationRun>> {
    let found = select_runs!(
        "e.id = (SELECT s.evaluation_id FROM scorings s WHERE s.job_id = ?)",
        Text(job)
    );
    Ok(found.fetch_optional(connection).await?)
}

/// The proposal that created the evaluation of a run, whether it is applied or not.
pub(crate) async fn proposal_of_run(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Option<ProposalId>> {
    let proposal = sqlx::query_scalar!(
        "SELECT proposal_id AS proposal FROM evaluations WHERE run_id = ?",
        run
    )
    .fetch_optional(connection)
    .await?;
    Ok(proposal.flatten())
}
