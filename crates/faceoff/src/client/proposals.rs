//! Requests about trials and proposed re-evaluations. A *trial* evaluates submissions without effect on the boards; a *proposed
//! re-evaluation* repeats counting evaluations, and its results count only once an organiser applies it.

use super::{Client, read_json};
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
    pub async fn trial(&self, stage: StageId, trial: &Trial) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/stages/{stage}/trial"));
        read_json(self.send(request.json(trial)).await?).await
    }

    /// Organiser: proposes a re-evaluation of results; the old ones count until it is applied.
    pub async fn propose(&self, stage: StageId, new: &NewProposal) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/stages/{stage}/proposals"));
        read_json(self.send(request.json(new)).await?).await
    }

    /// Organiser: applies a proposed re-evaluation.
    pub async fn apply_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/proposals/{id}/apply"));
        read_json(self.send(request.json(&Confirmation { confirm })).await?).await
    }

    /// Organiser: drops a proposed re-evaluation.
    pub async fn drop_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/proposals/{id}/drop"));
        read_json(self.send(request.json(&Confirmation { confirm })).await?).await
    }
}
