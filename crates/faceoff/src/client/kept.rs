//! Files that the server keeps: downloaded, deleted, and how much room they take.

use super::{Client, read};
use anyhow::{Context, bail};
use faceoff_http::{
    requests::DeleteSubmission,
    views::{storage::StorageView, submission::SubmissionView},
};
use faceoff_types::{EvaluationId, SubmissionId, TeamId};
use futures::StreamExt;
use reqwest::Method;
use std::path::Path;
use tokio::io::AsyncWriteExt;

impl Client {
    /// Team or organiser: downloads a dataset to `file`; returns its size in bytes.
    pub async fn download_dataset(&self, id: EvaluationId, file: &Path) -> anyhow::Result<u64> {
        self.download(&format!("/evaluations/{id}/dataset"), file)
            .await
    }

    /// Team or organiser: downloads the archive of a submission to `file`; returns its size in bytes.
    pub async fn download_submission(&self, id: SubmissionId, file: &Path) -> anyhow::Result<u64> {
        self.download(&format!("/submissions/{id}/archive"), file)
            .await
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

    /// Organiser: the room that each team's files take.
    pub async fn storage(&self) -> anyhow::Result<Vec<StorageView>> {
        self.get("/storage").await
    }

    /// Team or organiser: the room that a team's files take.
    pub async fn team_storage(&self, id: TeamId) -> anyhow::Result<StorageView> {
        self.get(&format!("/teams/{id}/storage")).await
    }

    pub(super) async fn download(&self, path: &str, file: &Path) -> anyhow::Result<u64> {
        let response = self.send(self.request(Method::GET, path)).await?;
        let announced = response.content_length();
        // A download that breaks off must not leave a file that looks whole.
        let partial = file.with_extension("part");
        let mut writer = tokio::fs::File::create(&partial)
            .await
            .with_context(|| format!("making {}", partial.display()))?;
        let mut bytes = 0;
        let mut stream = response.bytes_stream();
        while let Some(chunk) = stream.next().await {
            let chunk = chunk.context("reading the server's answer")?;
            bytes += chunk.len() as u64;
            writer
                .write_all(&chunk)
                .await
                .with_context(|| format!("writing {}", partial.display()))?;
        }
        writer
            .flush()
            .await
            .with_context(|| format!("writing {}", partial.display()))?;
        if announced.is_some_and(|announced| announced != bytes) {
            bail!("the download broke off after {bytes} bytes; try again");
        }
        tokio::fs::rename(&partial, file)
            .await
            .with_context(|| format!("naming {}", file.display()))?;
        Ok(bytes)
    }
}
