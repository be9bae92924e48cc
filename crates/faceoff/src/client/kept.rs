//! Files that the server keeps: downloaded, deleted, and how much room they take.

use super::{Client, download::Downloaded, read};
use faceoff_api::{
    requests::DeleteSubmission,
    views::{storage::StorageView, submission::SubmissionView, violations::ViolationsView},
};
use faceoff_types::{EvaluationId, SubmissionId, TeamId};
use indicatif::ProgressBar;
use reqwest::Method;
use std::path::Path;

impl Client {
    /// Team or organiser, and of a public one anybody: downloads a dataset to `file`; `published` is its hash, as the
    /// evaluation has it.
    pub async fn download_dataset(
        &self,
        id: EvaluationId,
        file: &Path,
        published: Option<&str>,
        bar: &ProgressBar,
    ) -> anyhow::Result<Downloaded> {
        let path = format!("/evaluations/{id}/dataset");
        self.download(&path, file, published, bar).await
    }

    /// Team or organiser: downloads the archive of a submission to `file`; `published` is its hash, as the
    /// submission has it.
    pub async fn download_submission(
        &self,
        id: SubmissionId,
        file: &Path,
        published: &str,
        bar: &ProgressBar,
    ) -> anyhow::Result<Downloaded> {
        let path = format!("/submissions/{id}/archive");
        self.download(&path, file, Some(published), bar).await
    }

    /// Team or organiser: has the archive of a submission removed.
    pub async fn delete_submission(
        &self,
        id: SubmissionId,
        wanted: &DeleteSubmission,
    ) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::DELETE, &format!("/submissions/{id}"));
        read(self.send(request.json(wanted)).await?).await
    }

    /// Who gets the dataset: where each constraint was broken.
    pub async fn violations(&self, id: EvaluationId) -> anyhow::Result<ViolationsView> {
        self.get(&format!("/evaluations/{id}/violations")).await
    }

    /// Organiser: the room that each team's files take.
    pub async fn storage(&self) -> anyhow::Result<Vec<StorageView>> {
        self.get("/storage").await
    }

    /// Team or organiser: the room that a team's files take.
    pub async fn team_storage(&self, id: TeamId) -> anyhow::Result<StorageView> {
        self.get(&format!("/teams/{id}/storage")).await
    }
}
