//! A team's submissions.

use super::{Client, read};
use crate::packing::BundleFile;
use anyhow::{Context, bail};
use faceoff_api::{
    requests::{OrderAblation, SubmissionChange},
    views::{ablation::AblationView, submission::SubmissionView},
};
use faceoff_types::SubmissionId;
use futures::StreamExt;
use indicatif::ProgressBar;
use reqwest::{Method, header};
use std::path::Path;
use tokio_util::io::ReaderStream;

impl Client {
    /// Team: uploads a bundle, an archive or a folder (packed on the way).
    pub async fn upload(&self, bundle: &Path) -> anyhow::Result<SubmissionView> {
        let path = bundle.to_owned();
        let bundle = tokio::task::spawn_blocking(move || BundleFile::open(&path))
            .await
            .context("packing the bundle")??;
        self.upload_with(&bundle, &ProgressBar::hidden()).await
    }

    /// Team: uploads a bundle and shows how far it is.
    pub async fn upload_with(
        &self,
        bundle: &BundleFile,
        progress: &ProgressBar,
    ) -> anyhow::Result<SubmissionView> {
        let bytes = bundle.bytes();
        let limit = self.me().await?.max_bundle_bytes;
        if bytes > limit {
            bail!(
                "the bundle has {bytes} bytes, the server takes at most {limit}; leave out what the \
                 agent does not need to run"
            );
        }
        progress.set_length(bytes);
        let file = tokio::fs::File::open(bundle.path())
            .await
            .with_context(|| format!("opening {}", bundle.path().display()))?;
        let counted = progress.clone();
        let stream = ReaderStream::with_capacity(file, 256 * 1024).inspect(move |chunk| {
            counted.inc(chunk.as_ref().map_or(0, |chunk| chunk.len() as u64));
        });
        let request = self
            .request(Method::POST, "/submissions")
            .query(&[("file_name", bundle.name())])
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, bytes)
            .body(reqwest::Body::wrap_stream(stream));
        read(self.send(request).await?).await
    }

    /// Team or organiser: one submission.
    pub async fn submission(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        self.get(&format!("/submissions/{id}")).await
    }

    /// Team or organiser: the newest ablation of a submission.
    pub async fn ablation(&self, id: SubmissionId) -> anyhow::Result<AblationView> {
        self.get(&format!("/submissions/{id}/ablation")).await
    }

    /// Organiser: orders one.
    pub async fn order_ablation(
        &self,
        id: SubmissionId,
        wanted: &OrderAblation,
    ) -> anyhow::Result<AblationView> {
        let path = format!("/submissions/{id}/ablation");
        self.tell(Method::POST, &path, wanted).await
    }

    /// Team: chooses the submission that plays at the next cut.
    pub async fn activate(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::POST, &format!("/submissions/{id}/activate"));
        read(self.send(request).await?).await
    }

    /// Team: its submissions, newest first.
    pub async fn submissions(&self) -> anyhow::Result<Vec<SubmissionView>> {
        self.list(self.request(Method::GET, "/submissions")).await
    }

    /// Team: takes a submission back.
    pub async fn withdraw(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::POST, &format!("/submissions/{id}/withdraw"));
        read(self.send(request).await?).await
    }

    /// Team: changes what it says of a submission.
    pub async fn describe(
        &self,
        id: SubmissionId,
        change: &SubmissionChange,
    ) -> anyhow::Result<SubmissionView> {
        let request = self.request(Method::PATCH, &format!("/submissions/{id}"));
        read(self.send(request.json(change)).await?).await
    }
}
