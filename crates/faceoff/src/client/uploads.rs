//! A team's submissions. A *submission* is an uploaded *bundle*, the files of an agent; an *ablation* evaluates it without
//! perturbations, with each one alone, and with all.

use super::{
    ApiError, Client, RETRY_PAUSE, Unreachable, is_refused_with, is_temporary, read_json,
    retry_while,
};
use crate::packing::BundleFile;
use anyhow::{Context, anyhow, bail};
use faceoff_api::{
    requests::{NewAblation, SubmissionChange},
    views::{
        ablation::AblationView, partial_upload::PartialUploadView, submission::SubmissionView,
    },
};
use faceoff_types::SubmissionId;
use futures::StreamExt;
use indicatif::ProgressBar;
use reqwest::{Method, StatusCode, header};
use std::{
    io::SeekFrom,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};
use tokio::{io::AsyncSeekExt, time::Instant};
use tokio_util::io::ReaderStream;
use uuid::Uuid;

/// Time for which attempts without any progress are repeated after temporary failures.
const RETRY_TIMEOUT: Duration = Duration::from_mins(5);

/// Longest time without a byte sent or an answer received; then the connection is given up.
const STALL_TIMEOUT: Duration = Duration::from_secs(60);

/// Size of the pieces of a part. It is so small that even a slow link sends one within [`STALL_TIMEOUT`].
const CHUNK_BYTES: usize = 16 << 10;

/// Longest duration of a part. It is the HTTP client's read timeout, which also runs while the client sends.
const UPLOAD_TIMEOUT: Duration = Duration::from_hours(24);

/// An upload of a bundle in parts. One part suffices unless its connection breaks.
struct PartialUpload<'a> {
    client: &'a Client,
    /// An HTTP client with [`UPLOAD_TIMEOUT`].
    http: reqwest::Client,
    bundle: &'a BundleFile,
    /// Path of the partial upload on the server.
    path: String,
    progress: &'a ProgressBar,
}

impl PartialUpload<'_> {
    /// Sends what the server does not have yet.
    async fn send(&self) -> anyhow::Result<()> {
        let mut most_received_bytes = 0;
        let mut give_up_at = Instant::now() + RETRY_TIMEOUT;
        loop {
            let error = match self
                .send_rest(&mut most_received_bytes, &mut give_up_at)
                .await
            {
                Ok(()) => return Ok(()),
                Err(error) => error,
            };
            // After a conflict, the server has received fewer or more bytes than this attempt assumed.
            if !(is_interruption(&error) || is_conflict(&error)) || Instant::now() >= give_up_at {
                return Err(error);
            }
            tokio::time::sleep(RETRY_PAUSE).await;
        }
    }

    /// Sends one part, from the first byte that the server does not have to the end. If the server has received more since
    /// the last attempt, the time for retries starts again.
    async fn send_rest(
        &self,
        most_received_bytes: &mut u64,
        give_up_at: &mut Instant,
    ) -> anyhow::Result<()> {
        let offset = match self.client.get::<PartialUploadView>(&self.path).await {
            Ok(upload) => upload.received_bytes,
            Err(error) if is_refused_with(&error, StatusCode::NOT_FOUND) => 0,
            Err(error) => return Err(error),
        };
        if offset > *most_received_bytes {
            *most_received_bytes = offset;
            *give_up_at = Instant::now() + RETRY_TIMEOUT;
        }
        self.progress.set_position(offset);
        let bytes = self.bundle.bytes();
        if offset >= bytes {
            return Ok(());
        }
        let opened = tokio::fs::File::open(self.bundle.path()).await;
        let mut file =
            opened.with_context(|| format!("opening {}", self.bundle.path().display()))?;
        file.seek(SeekFrom::Start(offset))
            .await
            .context("reading the bundle")?;
        let newest_chunk = Arc::new(Mutex::new(Instant::now()));
        let (progress, sent) = (self.progress.clone(), Arc::clone(&newest_chunk));
        let stream = ReaderStream::with_capacity(file, CHUNK_BYTES).inspect(move |chunk| {
            progress.inc(chunk.as_ref().map_or(0, |chunk| chunk.len() as u64));
            *sent.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        });
        let request = self
            .client
            .request_by(&self.http, Method::PATCH, &self.path)
            .header(header::CONTENT_TYPE, "application/octet-stream")
            .header(header::CONTENT_LENGTH, bytes - offset)
            .header("upload-offset", offset)
            .header("upload-length", bytes)
            .body(reqwest::Body::wrap_stream(stream));
        let sending = async {
            let upload: PartialUploadView = read_json(self.client.send(request).await?).await?;
            Ok(upload)
        };
        tokio::select! {
            sent = sending => sent.map(drop),
            () = stalled(&newest_chunk) => Err(anyhow!(
                "nothing could be sent for {} s", STALL_TIMEOUT.as_secs()
            ).context(Unreachable("the upload has stalled".to_owned()))),
        }
    }
}

/// Is this a conflict: does the server have other parts than the request assumed? Other refusals with the same status, such as the
/// end of the season, are permanent.
fn is_conflict(error: &anyhow::Error) -> bool {
    let refused = error.downcast_ref::<ApiError>();
    refused.is_some_and(|refused| refused.kind == "conflict")
}

/// Whether an upload may go on after this failure: not if a quota is used up or the server's disk is full, which may last.
fn is_interruption(error: &anyhow::Error) -> bool {
    let lasting_refusals = [
        StatusCode::TOO_MANY_REQUESTS,
        StatusCode::INSUFFICIENT_STORAGE,
    ];
    is_temporary(error)
        && !lasting_refusals
            .into_iter()
            .any(|status| is_refused_with(error, status))
}

/// Waits until no chunk has been sent for [`STALL_TIMEOUT`].
async fn stalled(newest_chunk: &Mutex<Instant>) {
    loop {
        let newest = *newest_chunk.lock().unwrap_or_else(PoisonError::into_inner);
        if newest.elapsed() >= STALL_TIMEOUT {
            return;
        }
        tokio::time::sleep_until(newest + STALL_TIMEOUT).await;
    }
}

impl Client {
    /// Team: uploads a bundle; a folder is packed first.
    pub async fn upload(&self, bundle: &Path) -> anyhow::Result<SubmissionView> {
        let path = bundle.to_owned();
        let bundle = tokio::task::spawn_blocking(move || BundleFile::open(&path))
            .await
            .context("packing the bundle")??;
        self.upload_with(&bundle, &ProgressBar::hidden()).await
    }

    /// Team: uploads a bundle and reports its progress. After a broken connection it goes on where the server has got to, also in a
    /// later call.
    pub async fn upload_with(
        &self,
        bundle: &BundleFile,
        progress: &ProgressBar,
    ) -> anyhow::Result<SubmissionView> {
        let bytes = bundle.bytes();
        let me = retry_while(is_interruption, RETRY_TIMEOUT, async || self.me().await).await?;
        let limit = me.max_bundle_bytes;
        if bytes > limit {
            bail!(
                "the bundle has {bytes} bytes, the server accepts at most {limit}; leave out files that the \
                agent does not need"
            );
        }
        progress.set_length(bytes);
        let path = bundle.path().to_owned();
        let hash = tokio::task::spawn_blocking(move || {
            let mut hasher = blake3::Hasher::new();
            hasher.update_reader(std::fs::File::open(&path)?)?;
            std::io::Result::Ok(hasher.finalize())
        });
        let hash = hash.await.context("hashing the bundle")?;
        let hash = hash.with_context(|| format!("reading {}", bundle.path().display()))?;
        let parts = PartialUpload {
            client: self,
            http: self.address.http(UPLOAD_TIMEOUT)?,
            bundle,
            path: format!("/uploads/{hash}"),
            progress,
        };
        // The same key for each attempt: if only the answer was lost, the next attempt returns the same submission.
        let key = Uuid::now_v7().to_string();
        let submit = async || {
            parts.send().await?;
            retry_while(is_interruption, RETRY_TIMEOUT, async || {
                let request = self
                    .request(Method::POST, "/submissions")
                    .query(&[("file_name", bundle.name()), ("upload", &hash.to_string())])
                    .header("idempotency-key", &key);
                read_json(self.send(request).await?).await
            })
            .await
        };
        match submit().await {
            // The server's file is damaged, for example by a power failure.
            Err(error) if is_conflict(&error) => {
                let removed = self.send(self.request(Method::DELETE, &parts.path)).await;
                // If the server has no parts to remove, the conflict has another reason.
                removed.map_err(|_| error)?;
                submit().await
            }
            submitted => submitted,
        }
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

    /// Team: changes the label or the note of a submission.
    pub async fn change_submission(
        &self,
        id: SubmissionId,
        change: &SubmissionChange,
    ) -> anyhow::Result<SubmissionView> {
        self.call_with_body(Method::PATCH, &format!("/submissions/{id}"), change)
            .await
    }
}
