//! Queries of proposals: trials and proposed re-evaluations, which do not count (yet).

use crate::{
    boxed,
    error::Result,
    queries::progress,
    store::Store,
    tables::{
        proposals::{self, Proposal},
        proposed_evaluations::{self, ProposedEvaluation},
    },
};
use faceoff_types::{EvaluationId, ProposalId};
use sqlx::SqliteConnection;

/// The evaluations of a proposal with their progress, in the order in which they were queued.
pub(crate) async fn evaluations_of_proposal(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<ProposedEvaluation>> {
    let rows = proposed_evaluations::of_proposal(connection, proposal).await?;
    let runs: Vec<_> = rows.iter().map(|row| row.run).collect();
    let progress_by_run = progress::of_runs(connection, &runs).await?;
    rows.into_iter()
        .map(|row| {
            let episodes_done = progress_by_run.get(&row.run).copied().unwrap_or(0);
            row.into_evaluation(episodes_done)
        })
        .collect()
}

impl Store {
    /// All trials and proposed re-evaluations, the newest first.
    #[boxed]
    pub async fn proposals(&self) -> Result<Vec<Proposal>> {
        proposals::all(&mut *self.database.read.acquire().await?).await
    }

    /// An evaluation of a proposal, with the proposal. [`StoreError::NotFound`](crate::StoreError::NotFound)
    /// for other evaluations.
    #[boxed]
    pub async fn proposed_evaluation(
        &self,
        id: EvaluationId,
    ) -> Result<(Proposal, ProposedEvaluation)> {
        let mut tx = self.database.read.begin().await?;
        let row = proposed_evaluations::find(&mut tx, id).await?;
        let proposal = proposals::find(&mut tx, row.proposal).await?;
        let progress_by_run = progress::of_runs(&mut tx, &[row.run]).await?;
        let episodes_done = progress_by_run.get(&row.run).copied().unwrap_or(0);
        Ok((proposal, row.into_evaluation(episodes_done)?))
    }

    /// A proposal with its evaluations.
    #[boxed]
    pub async fn proposal(&self, id: ProposalId) -> Result<(Proposal, Vec<ProposedEvaluation>)> {
        let mut tx = self.database.read.begin().await?;
        let proposal = proposals::find(&mut tx, id).await?;
        let evaluations = evaluations_of_proposal(&mut tx, id).await?;
        Ok((proposal, evaluations))
    }
}
