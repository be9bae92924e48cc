//! A team's submissions. A *submission* is an uploaded *bundle*, the files of an agent; an *ablation* evaluates it under each
//! perturbation alone.

use super::{Client, read_json};
use crate::packing::BundleFile;
use anyhow::{Context, bail};
use faceoff_api::{
    requests::{NewAblation, SubmissionChange},
    views::{ablation::AblationView, submission::SubmissionView},
};
use faceoff_types::SubmissionId;
use futures::StreamExt;
use indicatif::ProgressBar;
use reqwest::{Method, header};
use std::path::Path;
use tokio_util::io::ReaderStream;

impl Client {
    /// Team: uploads a bundle; a folder is packed first.
    pub async fn upload(&self, bundle: &Path) -> anyhow::Result<SubmissionView> {
        let path = bundle.to_owned();
        let bundle = tokio::task::spawn_blocking(move || BundleFile::open(&path))
            .await
            .context("packing the bundle")??;
        self.upload_with(&bundle, &ProgressBar::hidden()).await
    }

    /// Team: uploads a bundle and reports its progress.
    pub async fn upload_with(
        &self,
        bundle: &BundleFile,
        progress: &ProgressBar,
    ) -> anyhow::Result<SubmissionView> {
        let bytes = bundle.bytes();
        let limit = self.me().await?.max_bundle_bytes;
        if bytes > limit {
            bail!(
                "the bundle has {bytes} bytes, the server accepts at most {limit}; leave out files that the \
                agent does not need"
            );
        }
        progress.set_length(bytes);
        let file = tokio::fs::File::open(bundle.path())
            .await
            .with_context(|| format!("opening {}", bundle.path().display()))?;
        let upload_progress = progress.clone();
        let stream = ReaderStream::with_capacity(file, 256 * 1024).inspect(move |chunk| {
            upload_progress.inc(chunk.as_ref().map_or(0, |chunk| chunk.len() as u64));
        });
        let request = self
            .request(Method::POST, "/submissions")
            .query(&[("file_name", bundle.name())])
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, bytes)
            .body(reqwest::Body::wrap_stream(stream));
        read_json(self.send(request).await?).await
    }

    /// Team or organiser: one submission.
    pub async fn submission(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        self.get(&format!("/submissions/{id}")).await
    }

    /// Team or organiser: the newest ablation of a submission.
    pub async fn ablation(&self, id: SubmissionId) -> anyhow::Result<AblationView> {
        self.get(&format!("/submissions/{id}/ablation")).await
    }

    /// Organiser: requests an ablation of a submission.
    pub async fn request_ablation(
        &self,
        id: SubmissionId,
        request: &NewAblation,
    ) -> anyhow::Result<AblationView> {
        let path = format!("/submissions/{id}/ablation");
        self.post(&path, request).await
    }

    /// Team: makes a submission active for the next cutoff.
    pub async fn activate(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        self.post_empty(&format!("/submissions/{id}/activate"))
            .await
    }

    /// Team: its submissions, newest first.
    pub async fn submissions(&self) -> anyhow::Result<Vec<SubmissionView>> {
        self.list(self.request(Method::GET, "/submissions")).await
    }

    /// Team: withdraws its active submission.
    pub async fn withdraw(&self, id: SubmissionId) -> anyhow::Result<SubmissionView> {
        self.post_empty(&format!("/submissions/{id}/withdraw"))
            .await
    }

    /// Team: changes the description of a submission.
    pub async fn describe(
        &self,
        id: SubmissionId,
        change: &SubmissionChange,
    ) -> anyhow::Result<SubmissionView> {
        self.call_with_body(Method::PATCH, &format!("/submissions/{id}"), change)
            .await
    }
}
