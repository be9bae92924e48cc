use crate::{
    boxed,
    error::Result,
    reads::progress,
    store::Store,
    tables::{
        drafts::{self, Draft},
        proposals::{self, Proposal},
    },
};
use faceoff_types::{EvaluationId, ProposalId};
use sqlx::SqliteConnection;

/// The drafts of a proposal with their progress, in the order in which they were queued.
pub(crate) async fn drafts_of(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<Draft>> {
    let rows = drafts::of_proposal(connection, proposal).await?;
    let runs: Vec<_> = rows.iter().map(|row| row.run.0).collect();
    let done = progress::of_runs(connection, &runs).await?;
    rows.into_iter()
        .map(|row| {
            let episodes_done = done.get(&row.run.0).copied().unwrap_or(0);
            row.into_draft(episodes_done)
        })
        .collect()
}

impl Store {
    /// All proposals and trials, the newest first.
    #[boxed]
    pub async fn proposals(&self) -> Result<Vec<Proposal>> {
        proposals::all(&mut *self.database.read.acquire().await?).await
    }

    /// One evaluation of a proposal or a trial, with this. [`StoreError::NotFound`](crate::StoreError::NotFound) of
    /// those that never were of one.
    #[boxed]
    pub async fn draft(&self, id: EvaluationId) -> Result<(Proposal, Draft)> {
        let mut tx = self.database.read.begin().await?;
        let row = drafts::find(&mut tx, id).await?;
        let proposal = proposals::find(&mut tx, row.proposal.0).await?;
        let done = progress::of_runs(&mut tx, &[row.run.0]).await?;
        let episodes_done = done.get(&row.run.0).copied().unwrap_or(0);
        Ok((proposal, row.into_draft(episodes_done)?))
    }

    /// A proposal with its evaluations.
    #[boxed]
    pub async fn proposal(&self, id: ProposalId) -> Result<(Proposal, Vec<Draft>)> {
        let mut tx = self.database.read.begin().await?;
        let proposal = proposals::find(&mut tx, id).await?;
        let drafts = drafts_of(&mut tx, id).await?;
        Ok((proposal, drafts))
    }
}
