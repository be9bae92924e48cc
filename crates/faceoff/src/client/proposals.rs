//! Trials and re-evaluations.

use super::{Client, read};
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

    /// Organiser: one, with what it plays and what it would change.
    pub async fn proposal(&self, id: ProposalId) -> anyhow::Result<ProposalView> {
        self.get(&format!("/proposals/{id}")).await
    }

    /// Organiser: tries what is active without counting.
    pub async fn trial(&self, stage: StageId, wanted: &Trial) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/stages/{stage}/trial"));
        read(self.send(request.json(wanted)).await?).await
    }

    /// Organiser: plays results again beside what counts.
    pub async fn propose(
        &self,
        stage: StageId,
        wanted: &NewProposal,
    ) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/stages/{stage}/proposals"));
        read(self.send(request.json(wanted)).await?).await
    }

    /// Organiser: has what was played again count.
    pub async fn apply_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/proposals/{id}/apply"));
        read(self.send(request.json(&Confirmation { confirm })).await?).await
    }

    /// Organiser: has it never count.
    pub async fn drop_proposal(
        &self,
        id: ProposalId,
        confirm: Option<String>,
    ) -> anyhow::Result<ProposalView> {
        let request = self.request(Method::POST, &format!("/proposals/{id}/drop"));
        read(self.send(request.json(&Confirmation { confirm })).await?).await
    }
}
