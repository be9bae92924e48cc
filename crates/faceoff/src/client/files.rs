//! Files on the server: download, deletion and disk usage.

use super::{Client, download::DownloadedFile};
use faceoff_api::{
    requests::DeleteSubmission,
    views::{storage::StorageView, submission::SubmissionView, violations::ViolationsView},
};
use faceoff_types::{EvaluationId, SubmissionId, TeamId};
use indicatif::ProgressBar;
use reqwest::Method;
use std::path::Path;

impl Client {
    /// Downloads a dataset to `file`: for its team and organisers, or for everyone if it is public. `expected_blake3` is
    /// the hash that the evaluation names.
    pub async fn download_dataset(
        &self,
        id: EvaluationId,
        file: &Path,
        expected_blake3: Option<&str>,
        bar: &ProgressBar,
    ) -> anyhow::Result<DownloadedFile> {
        let path = format!("/evaluations/{id}/dataset");
        self.download(&path, file, expected_blake3, bar).await
    }

    /// Team or organiser: downloads the bundle of a submission to `file`. `expected_blake3` is the hash that the submission
    /// names.
    pub async fn download_submission(
        &self,
        id: SubmissionId,
        file: &Path,
        expected_blake3: &str,
        bar: &ProgressBar,
    ) -> anyhow::Result<DownloadedFile> {
        let path = format!("/submissions/{id}/bundle");
        self.download(&path, file, Some(expected_blake3), bar).await
    }

    /// Team or organiser: deletes the bundle of a submission.
    pub async fn delete_submission(
        &self,
        id: SubmissionId,
        deletion: &DeleteSubmission,
    ) -> anyhow::Result<SubmissionView> {
        self.call_with_body(Method::DELETE, &format!("/submissions/{id}"), deletion)
            .await
    }

    /// The constraint violations of an evaluation, for everyone who may download its dataset.
    pub async fn violations(&self, id: EvaluationId) -> anyhow::Result<ViolationsView> {
        self.get(&format!("/evaluations/{id}/violations")).await
    }

    /// Organiser: the disk usage of all teams.
    pub async fn storage(&self) -> anyhow::Result<Vec<StorageView>> {
        self.get("/storage").await
    }

    /// Team or organiser: the disk usage of one team.
    pub async fn team_storage(&self, id: TeamId) -> anyhow::Result<StorageView> {
        self.get(&format!("/teams/{id}/storage")).await
    }
}
