//! Receives the body of an upload, mostly a *bundle*: the archive file or container image with a team's agent. The body is
//! streamed to a file, so that it is never completely in memory; meanwhile its bytes are counted and hashed, and its format
//! is detected. This module does not unpack it.

use crate::{
    boxed_future, free_space,
    problem::{Problem, ProblemKind},
    transfer_rate::{MinTransferRate, TransferRateGuard},
};
use axum::body::{Body, BodyDataStream};
use faceoff_types::ArchiveFormat;
use futures::StreamExt;
use std::{io, path::Path};
use tempfile::{NamedTempFile, TempPath};
use tokio::{io::AsyncWriteExt, time::Instant};

/// Number of first bytes that the message about an unknown format quotes. A format is recognised by its first bytes, and all but
/// a plain tar by the first four.
const QUOTED_BYTES: usize = 4;

/// A bundle on disk. The file is removed when this is dropped, unless it is that of an upload in parts.
#[derive(Debug)]
pub struct ReceivedBundle {
    pub file: TempPath,
    /// Size of the bundle in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the whole bundle.
    pub blake3: blake3::Hash,
    /// Detected from the first bytes.
    pub format: ArchiveFormat,
}

impl ReceivedBundle {
    /// Removes the file, whichever kind of upload it is of.
    ///
    /// # Errors
    /// If it cannot be removed.
    pub(super) fn remove(self) -> io::Result<()> {
        self.file.close()
    }
}

/// Size limit of a bundle.
pub(crate) struct SizeLimit {
    pub(crate) max_bytes: u64,
    /// Makes the problem for a larger bundle, given its announced number of bytes (header `Content-Length`), if any.
    pub make_problem: Box<dyn Fn(Option<u64>) -> Problem + Send + Sync>,
}

/// A body that must arrive at a minimum transfer rate.
pub(super) struct RateGuardedBody {
    stream: BodyDataStream,
    rate: MinTransferRate,
    guard: TransferRateGuard,
    /// What is stored if the body breaks off, and what the client should do, for messages.
    retry_advice: &'static str,
}

/// Streams a bundle into a file under `dir`. `announced_bytes` is the size that the client has announced (`Content-Length`).
///
/// # Errors
/// The problem of `limit` if the body is larger; `UnsupportedMediaType` for an unknown format; `RequestTimeout` if it is
/// slower than `rate`; `InvalidRequest` if it is empty or breaks off; `StorageFull` if the disk is full; `Internal` if
/// writing fails.
pub(crate) async fn receive(
    body: Body,
    announced_bytes: Option<u64>,
    dir: &Path,
    limit: &SizeLimit,
    rate: MinTransferRate,
) -> Result<ReceivedBundle, Problem> {
    let max_bytes = limit.max_bytes;
    let mut body = RateGuardedBody::new(body, rate);
    if let Some(bytes) = announced_bytes.filter(|bytes| *bytes > max_bytes) {
        return Err((limit.make_problem)(Some(bytes)));
    }

    let file = create_temp_file(dir)?;
    let mut writer = tokio::fs::File::from_std(file.reopen().map_err(Problem::internal)?);
    let mut hasher = blake3::Hasher::new();
    let mut first_bytes = Vec::with_capacity(ArchiveFormat::DETECTION_BYTES);
    let mut format = None;
    let mut bytes = 0;
    while let Some(chunk) = body.next_chunk().await? {
        bytes += chunk.len() as u64;
        if bytes > max_bytes {
            return Err((limit.make_problem)(None));
        }
        if format.is_none() {
            let missing_bytes = ArchiveFormat::DETECTION_BYTES - first_bytes.len();
            first_bytes.extend_from_slice(&chunk[..missing_bytes.min(chunk.len())]);
            format = ArchiveFormat::detect(&first_bytes);
            if format.is_none() && first_bytes.len() == ArchiveFormat::DETECTION_BYTES {
                return Err(not_an_archive(&first_bytes));
            }
        }
        hasher.update(&chunk);
        let written = writer.write_all(&chunk).await;
        written.map_err(free_space::write_problem)?;
    }
    if bytes == 0 {
        return Err(Problem::new(
            ProblemKind::InvalidRequest,
            "expected a bundle, got an empty body; upload the bundle file itself (.tar.gz, .tar.zst, .zip, or .tar of a container \
             image)",
        ));
    }
    let format = format.ok_or_else(|| not_an_archive(&first_bytes))?;
    // The artifact is copied from this file by name, so the writer's buffer must be flushed.
    writer.flush().await.map_err(free_space::write_problem)?;
    Ok(ReceivedBundle {
        file: file.into_temp_path(),
        bytes,
        blake3: hasher.finalize(),
        format,
    })
}

/// Streams a body of any kind into a file under `dir`.
///
/// # Errors
/// `TooLarge` beyond `max_bytes`; otherwise as [`receive`].
#[boxed_future]
pub async fn receive_file(
    body: Body,
    dir: &Path,
    max_bytes: u64,
    rate: MinTransferRate,
) -> Result<NamedTempFile, Problem> {
    let mut body = RateGuardedBody::new(body, rate);
    let file = create_temp_file(dir)?;
    let mut writer = tokio::fs::File::from_std(file.reopen().map_err(Problem::internal)?);
    let mut bytes = 0;
    while let Some(chunk) = body.next_chunk().await? {
        bytes += chunk.len() as u64;
        if bytes > max_bytes {
            return Err(too_large(max_bytes, None));
        }
        let written = writer.write_all(&chunk).await;
        written.map_err(free_space::write_problem)?;
    }
    writer.flush().await.map_err(free_space::write_problem)?;
    Ok(file)
}

fn create_temp_file(dir: &Path) -> Result<NamedTempFile, Problem> {
    tempfile::Builder::new()
        .prefix("upload-")
        .tempfile_in(dir)
        .map_err(free_space::write_problem)
}

/// Reads and discards a body until its end, until `max_bytes` are discarded, or until it is slower than `rate`.
#[boxed_future]
pub async fn discard(body: Body, rate: MinTransferRate, max_bytes: u64) {
    let mut body = RateGuardedBody::new(body, rate);
    let mut left = max_bytes;
    while left > 0 {
        match body.next_chunk().await {
            Ok(Some(chunk)) => left = left.saturating_sub(chunk.len() as u64),
            Ok(None) | Err(_) => return,
        }
    }
}

impl RateGuardedBody {
    pub(super) fn new(body: Body, rate: MinTransferRate) -> Self {
        Self {
            stream: body.into_data_stream(),
            rate,
            guard: TransferRateGuard::new(rate),
            retry_advice: "nothing was stored; send it again",
        }
    }

    /// The body of one part of a partial upload: bytes that arrive are kept, even if the rest does not follow.
    pub(super) fn of_part(body: Body, rate: MinTransferRate) -> Self {
        Self {
            retry_advice: "what has arrived is kept; GET /api/v1/uploads/HASH says how much, send the rest",
            ..Self::new(body, rate)
        }
    }

    pub(super) async fn next_chunk(&mut self) -> Result<Option<axum::body::Bytes>, Problem> {
        let started = Instant::now();
        let received = tokio::time::timeout(self.guard.remaining(), self.stream.next()).await;
        self.guard.record_wait(started.elapsed());
        match received {
            Ok(None) => Ok(None),
            Ok(Some(Ok(chunk))) => {
                self.guard.record_bytes(chunk.len());
                Ok(Some(chunk))
            }
            Ok(Some(Err(error))) => Err(Problem::new(
                ProblemKind::InvalidRequest,
                format!(
                    "the upload was interrupted ({error}); {}",
                    self.retry_advice
                ),
            )),
            Err(_) => Err(too_slow(self.rate, self.retry_advice)),
        }
    }
}

fn too_slow(rate: MinTransferRate, retry_advice: &str) -> Problem {
    let MinTransferRate { bytes_per_s, grace } = rate;
    Problem::new(
        ProblemKind::RequestTimeout,
        format!(
            "the upload was more than {} s behind the minimum rate of {bytes_per_s} bytes per second; {retry_advice}, if possible over a \
             faster connection",
            grace.as_secs_f64()
        ),
    )
    .with("least_bytes_per_s", bytes_per_s)
}

/// The problem of a bundle that exceeds the limit for all teams.
pub(crate) fn too_large(max_bytes: u64, announced_bytes: Option<u64>) -> Problem {
    let size =
        announced_bytes.map_or_else(|| "got more".to_owned(), |bytes| format!("got {bytes}"));
    Problem::new(
        ProblemKind::TooLarge,
        format!(
            "expected a bundle of at most {max_bytes} bytes, {size}; leave out what the agent does not need \
             to run (training data, checkpoints, virtual environments)"
        ),
    )
    .with("limit_bytes", max_bytes)
}

pub(super) fn not_an_archive(first_bytes: &[u8]) -> Problem {
    Problem::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "expected a .tar.gz, .tar.zst or .zip bundle, or the .tar of a container image, got a file that begins with the \
             bytes {}. Upload the bundle file itself (over the API as the body, not as a form)",
            hex::encode(&first_bytes[..first_bytes.len().min(QUOTED_BYTES)])
        ),
    )
}
