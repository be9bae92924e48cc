//! End of the evaluations of a proposal: a trial, which never counts, or a re-evaluation, which counts only once an
//! organiser applies it. Until then they affect no board and no evaluation day.

use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{purpose, runs},
    queue,
    tables::{evaluations::Failure, proposed_evaluations},
    write::Tx,
};
use faceoff_types::{EvaluationId, ProposalId, RunId};

/// Queues the scoring of a proposal's evaluation after its last shard is committed.
pub(crate) async fn queue_scoring(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let account = queue::account(tx, purpose::SCORING.lane, purpose::PLATFORM_ACCOUNT).await?;
    let job = queue::insert(tx, purpose::SCORING, account).await?;
    proposed_evaluations::insert_scoring(tx, id, job).await
}

/// Ends a proposal's evaluation without a score.
pub(crate) async fn fail(
    tx: &mut Tx,
    id: EvaluationId,
    run: RunId,
    proposal: ProposalId,
    failure: Failure<'_>,
) -> Result<()> {
    runs::stop(tx, run).await?;
    let scoring = proposed_evaluations::job_of(tx, id).await?;
    queue::drop_jobs(tx, scoring.as_slice()).await?;
    let now = tx.now;
    proposed_evaluations::set_failed(tx, id, failure, now).await?;
    record_if_over(tx, proposal).await
}

/// Records the end of a proposal once all its evaluations have ended.
pub(crate) async fn record_if_over(tx: &mut Tx, proposal: ProposalId) -> Result<()> {
    if proposed_evaluations::count_open(tx, Some(proposal)).await? == 0 {
        tx.record(Subject::Proposal(proposal), Event::ProposalPlayed);
    }
    Ok(())
}
