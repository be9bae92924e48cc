//! Queries of proposals: trials and proposed re-evaluations, which do not count (yet).

use crate::{
    boxed_future,
    error::{Result, StoreError},
    queries::evaluations::with_progress_by,
    store::Store,
    tables::{
        evaluations::{self, EvaluationRow, ProposedEvaluation},
        proposals::{self, Proposal},
    },
};
use faceoff_types::{EvaluationId, ProposalId};
use sqlx::SqliteConnection;

/// The evaluations of a proposal with their progress, in the order in which they were queued.
pub(crate) async fn evaluations_of_proposal(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<ProposedEvaluation>> {
    let rows = evaluations::of_proposal(connection, proposal).await?;
    with_progress_by(connection, rows, EvaluationRow::into_proposed).await
}

impl Store {
    /// All trials and proposed re-evaluations, the newest first.
    #[boxed_future]
    pub async fn proposals(&self) -> Result<Vec<Proposal>> {
        proposals::all(&mut *self.database.read.acquire().await?).await
    }

    /// An evaluation of a proposal, with the proposal. [`StoreError::NotFound`](crate::StoreError::NotFound)
    /// for evaluations that count.
    #[boxed_future]
    pub async fn proposed_evaluation(
        &self,
        id: EvaluationId,
    ) -> Result<(Proposal, ProposedEvaluation)> {
        let mut tx = self.database.read.begin().await?;
        let row = evaluations::find_proposed(&mut tx, id).await?;
        let proposal = proposals::find(&mut tx, row.proposal()?).await?;
        let mut found = with_progress_by(&mut tx, vec![row], EvaluationRow::into_proposed).await?;
        let evaluation = found.pop().ok_or(StoreError::NotFound("evaluation"))?;
        Ok((proposal, evaluation))
    }

    /// A proposal with its evaluations.
    #[boxed_future]
    pub async fn proposal(&self, id: ProposalId) -> Result<(Proposal, Vec<ProposedEvaluation>)> {
        let mut tx = self.database.read.begin().await?;
        let proposal = proposals::find(&mut tx, id).await?;
        let evaluations = evaluations_of_proposal(&mut tx, id).await?;
        Ok((proposal, evaluations))
    }
}
