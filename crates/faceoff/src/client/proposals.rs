//! Requests about trials and proposed re-evaluations. A *trial* evaluates submissions without effect on the boards; a *proposed
//! re-evaluation* repeats counting evaluations, and its results count only once an organiser applies it.

use super::Client;
use faceoff_api::{
    requests::{Confirmation, NewProposal, Trial},
    views::proposal::ProposalView,
};
use faceoff_types::{ProposalId, StageId};
use reqwest::Method;

impl Client {
    /// Organiser: all trials and proposals, the newest first.
    pub async fn proposals(&self) -> anyhow::Result<Vec<ProposalView>> {
        self.list(self.request(Method::GET, "/proposals")).await
    }

    /// Organiser: one proposal, with its evaluations and the changes of the board.
    pub async fn proposal(&self, id: ProposalId) -> anyhow::Result<ProposalView> {
        self.get(&format!("/proposals/{id}")).await
    }

    /// Organiser: starts a trial of the active submissions.
    pub async fn start_trial(&self, stage: StageId, trial: &Trial) -> anyhow::Result<ProposalView> {
        self.post(&format!("/stages/{stage}/trial"), trial).await
    }

    /// Organiser: proposes a re-evaluation of results; the old ones count until it is applied.
    pub async fn propose(&self, stage: StageId, new: &NewProposal) -> anyhow::Result<ProposalView> {
        self.post(&format!("/stages/{stage}/proposals"), new).await
    }

    /// Organiser: applies a proposed re-evaluation.
    pub async fn apply_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        self.post(&format!("/proposals/{id}/apply"), &Confirmation { confirm })
            .await
    }

    /// Organiser: drops a proposed re-evaluation.
    pub async fn drop_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        self.post(&format!("/proposals/{id}/drop"), &Confirmation { confirm })
            .await
    }
}
