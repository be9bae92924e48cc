//! What the evaluations of proposals come to: as of those that count, but for nobody's board, turn or day.

use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{purpose, runs},
    queue,
    tables::{drafts, evaluations::Failure},
    write::Tx,
};
use faceoff_types::{EvaluationId, ProposalId, RunId};

/// All of its shards are committed: its score is computed.
pub(crate) async fn queue_finalisation(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let account = queue::account(tx, purpose::FINALISE.lane, purpose::PLATFORM).await?;
    let unit = queue::insert(tx, purpose::FINALISE, account).await?;
    drafts::insert_finalisation(tx, id, unit).await
}

/// Ends a draft without a score.
pub(crate) async fn fail(
    tx: &mut Tx,
    id: EvaluationId,
    run: RunId,
    proposal: ProposalId,
    failure: Failure<'_>,
) -> Result<()> {
    runs::stop(tx, run).await?;
    let scoring = drafts::finalisation_of(tx, id).await?;
    queue::drop_units(tx, scoring.as_slice()).await?;
    let now = tx.now;
    drafts::set_failed(tx, id, failure, now).await?;
    tell_if_over(tx, proposal).await
}

/// Tells of the end of a proposal if it was its last draft that has just ended.
pub(crate) async fn tell_if_over(tx: &mut Tx, proposal: ProposalId) -> Result<()> {
    if drafts::count_open(tx, Some(proposal)).await? == 0 {
        tx.record(Subject::Proposal(proposal), Event::ProposalPlayed);
    }
    Ok(())
}
