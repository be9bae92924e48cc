//! Receives a bundle: streamed to a file, counted, hashed, and recognised by its first bytes. It is
//! never held in memory and never unpacked here.

use crate::{
    boxed,
    pace::{LeastRate, Pace},
    problem::{Problem, ProblemKind},
    room,
};
use axum::body::{Body, BodyDataStream};
use faceoff_types::ArchiveFormat;
use futures::StreamExt;
use std::path::Path;
use tempfile::NamedTempFile;
use tokio::{io::AsyncWriteExt, time::Instant};

/// After a refusal we read on and throw away this much, so that a client that is still sending gets
/// the answer instead of a broken connection.
const DRAIN_BYTES: u64 = 64 * 1024 * 1024;

/// So much of what is no archive is shown: a plain tar alone is told by more.
const SHOWN_BYTES: usize = 4;

/// A bundle on disk; the file goes when this is dropped.
#[derive(Debug)]
pub struct Uploaded {
    pub file: NamedTempFile,
    /// Its size in bytes.
    pub bytes: u64,
    /// BLAKE3 of all of its bytes.
    pub blake3: blake3::Hash,
    /// What kind of archive its first bytes are of.
    pub format: ArchiveFormat,
}

/// How large a bundle may be, and what is said to a larger one. It is told the number of its bytes, where
/// that was announced.
pub(crate) struct Allowance {
    pub(crate) max_bytes: u64,
    pub beyond: Box<dyn Fn(Option<u64>) -> Problem + Send + Sync>,
}

/// A body that must come at a rate.
struct Incoming {
    stream: BodyDataStream,
    rate: LeastRate,
    pace: Pace,
}

/// Streams `body` into a file under `dir`.
///
/// # Errors
/// What `allowance` says beyond it, whether or not a length was announced; `UnsupportedMediaType` when
/// the first bytes are no archive's; `RequestTimeout` when it comes slower than `rate`; `InvalidRequest`
/// when the body is empty or breaks off; `StorageFull` when the disk is, `Internal` when it fails.
pub(crate) async fn receive(
    body: Body,
    announced: Option<u64>,
    dir: &Path,
    allowance: &Allowance,
    rate: LeastRate,
) -> Result<Uploaded, Problem> {
    let max_bytes = allowance.max_bytes;
    let mut incoming = Incoming::new(body, rate);
    if let Some(bytes) = announced.filter(|bytes| *bytes > max_bytes) {
        incoming.drain(bytes).await;
        return Err((allowance.beyond)(Some(bytes)));
    }

    let file = new_file(dir)?;
    let mut writer = tokio::fs::File::from_std(file.reopen().map_err(Problem::internal)?);
    let mut hasher = blake3::Hasher::new();
    let mut head = Vec::with_capacity(ArchiveFormat::LONGEST_MAGIC);
    let mut format = None;
    let mut bytes = 0;
    while let Some(chunk) = incoming.next().await? {
        bytes += chunk.len() as u64;
        if bytes > max_bytes {
            incoming.drain(DRAIN_BYTES).await;
            return Err((allowance.beyond)(None));
        }
        if format.is_none() {
            let missing = ArchiveFormat::LONGEST_MAGIC - head.len();
            head.extend_from_slice(&chunk[..missing.min(chunk.len())]);
            format = ArchiveFormat::detect(&head);
            if format.is_none() && head.len() == ArchiveFormat::LONGEST_MAGIC {
                incoming.drain(announced.unwrap_or(DRAIN_BYTES)).await;
                return Err(not_an_archive(&head));
            }
        }
        hasher.update(&chunk);
        if let Err(error) = writer.write_all(&chunk).await {
            incoming.drain(announced.unwrap_or(DRAIN_BYTES)).await;
            return Err(room::unwritten(error));
        }
    }
    if bytes == 0 {
        return Err(Problem::new(
            ProblemKind::InvalidRequest,
            "what came is empty; send the archive itself (.tar.gz, .tar.zst, .zip, or .tar of a container image)",
        ));
    }
    let format = format.ok_or_else(|| not_an_archive(&head))?;
    // The artifact is copied from this file by name; all of it must have left the writer's buffer.
    writer.flush().await.map_err(room::unwritten)?;
    Ok(Uploaded {
        file,
        bytes,
        blake3: hasher.finalize(),
        format,
    })
}

/// Streams a body of any kind into a file under `dir`.
///
/// # Errors
/// `TooLarge` beyond `max_bytes`; otherwise as [`receive`].
#[boxed]
pub async fn receive_file(
    body: Body,
    dir: &Path,
    max_bytes: u64,
    rate: LeastRate,
) -> Result<NamedTempFile, Problem> {
    let mut incoming = Incoming::new(body, rate);
    let file = new_file(dir)?;
    let mut writer = tokio::fs::File::from_std(file.reopen().map_err(Problem::internal)?);
    let mut bytes = 0;
    while let Some(chunk) = incoming.next().await? {
        bytes += chunk.len() as u64;
        if bytes > max_bytes {
            incoming.drain(DRAIN_BYTES).await;
            return Err(too_large(max_bytes, None));
        }
        if let Err(error) = writer.write_all(&chunk).await {
            incoming.drain(DRAIN_BYTES).await;
            return Err(room::unwritten(error));
        }
    }
    writer.flush().await.map_err(room::unwritten)?;
    Ok(file)
}

fn new_file(dir: &Path) -> Result<NamedTempFile, Problem> {
    tempfile::Builder::new()
        .prefix("upload-")
        .tempfile_in(dir)
        .map_err(room::unwritten)
}

/// Throws a body away that is refused before it is looked at.
#[boxed]
pub async fn discard(body: Body, rate: LeastRate) {
    Incoming::new(body, rate).drain(DRAIN_BYTES).await;
}

impl Incoming {
    fn new(body: Body, rate: LeastRate) -> Self {
        Self {
            stream: body.into_data_stream(),
            rate,
            pace: Pace::new(rate),
        }
    }

    async fn next(&mut self) -> Result<Option<axum::body::Bytes>, Problem> {
        let asked = Instant::now();
        let came = tokio::time::timeout(self.pace.left(), self.stream.next()).await;
        self.pace.waited(asked.elapsed());
        match came {
            Ok(None) => Ok(None),
            Ok(Some(Ok(chunk))) => {
                self.pace.moved(chunk.len());
                Ok(Some(chunk))
            }
            Ok(Some(Err(error))) => Err(Problem::new(
                ProblemKind::InvalidRequest,
                format!("the upload broke off ({error}); nothing was stored, send it again"),
            )),
            Err(_) => Err(too_slow(self.rate)),
        }
    }

    /// Throws away what the client still sends, up to [`DRAIN_BYTES`].
    async fn drain(&mut self, at_most: u64) {
        let mut left = at_most.min(DRAIN_BYTES);
        while left > 0 {
            match self.next().await {
                Ok(Some(chunk)) => left = left.saturating_sub(chunk.len() as u64),
                Ok(None) | Err(_) => return,
            }
        }
    }
}

fn too_slow(rate: LeastRate) -> Problem {
    let LeastRate { bytes_per_s, grace } = rate;
    Problem::new(
        ProblemKind::RequestTimeout,
        format!(
            "the upload was more than {} s behind the least rate of {bytes_per_s} bytes per second; nothing \
             was stored, send it again over a faster connection",
            grace.as_secs_f64()
        ),
    )
    .with("least_bytes_per_s", bytes_per_s)
}

pub(crate) fn too_large(max_bytes: u64, announced: Option<u64>) -> Problem {
    let came = announced.map_or_else(|| "more came".to_owned(), |n| format!("{n} were announced"));
    Problem::new(
        ProblemKind::TooLarge,
        format!(
            "a bundle has at most {max_bytes} bytes, {came}; leave out what the agent does not need \
             to run (training data, checkpoints, virtual environments)"
        ),
    )
    .with("limit_bytes", max_bytes)
}

fn not_an_archive(head: &[u8]) -> Problem {
    Problem::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "expected a .tar.gz, .tar.zst or .zip archive, or the .tar of a container image; what came begins with the \
             bytes {}. Send the archive itself, and nothing around it",
            hex::encode(&head[..head.len().min(SHOWN_BYTES)])
        ),
    )
}
