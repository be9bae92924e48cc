//! Receives a bundle: streamed to a file, counted, hashed, and recognised by its first bytes. It is
//! never held in memory and never unpacked here.

use crate::{
    problem::{Problem, ProblemKind},
    room,
};
use axum::{
    body::{Body, BodyDataStream},
    http::HeaderValue,
};
use faceoff_types::ArchiveFormat;
use futures::StreamExt;
use std::{path::Path, time::Duration};
use tempfile::NamedTempFile;
use tokio::io::AsyncWriteExt;

/// After a refusal we read on and throw away this much, so that a client that is still sending gets
/// the answer instead of a broken connection.
const DRAIN_BYTES: u64 = 64 * 1024 * 1024;

/// A bundle on disk; the file goes when this is dropped.
#[derive(Debug)]
pub(crate) struct Uploaded {
    pub(crate) file: NamedTempFile,
    pub(crate) bytes: u64,
    pub(crate) blake3: blake3::Hash,
    pub(crate) format: ArchiveFormat,
}

/// Streams `body` into a file under `dir`.
///
/// # Errors
/// `TooLarge` beyond `max_bytes`, whether or not a length was announced; `UnsupportedMediaType` when
/// the first bytes are no archive's; `RequestTimeout` after a pause of `patience`; `InvalidRequest`
/// when the body is empty or breaks off; `StorageFull` when the disk is, `Internal` when it fails.
pub(crate) async fn receive(
    body: Body,
    announced: Option<&HeaderValue>,
    dir: &Path,
    max_bytes: u64,
    patience: Duration,
) -> Result<Uploaded, Problem> {
    let announced: Option<u64> = announced.and_then(|value| value.to_str().ok()?.parse().ok());
    let mut stream = body.into_data_stream();
    if let Some(bytes) = announced.filter(|bytes| *bytes > max_bytes) {
        drain(&mut stream, bytes, patience).await;
        return Err(too_large(max_bytes, Some(bytes)));
    }

    let file = tempfile::Builder::new()
        .prefix("upload-")
        .tempfile_in(dir)
        .map_err(room::unwritten)?;
    let mut writer = tokio::fs::File::from_std(file.reopen().map_err(Problem::internal)?);
    let mut hasher = blake3::Hasher::new();
    let mut head = Vec::with_capacity(ArchiveFormat::LONGEST_MAGIC);
    let mut format = None;
    let mut bytes = 0;
    while let Some(chunk) = next(&mut stream, patience).await? {
        bytes += chunk.len() as u64;
        if bytes > max_bytes {
            drain(&mut stream, DRAIN_BYTES, patience).await;
            return Err(too_large(max_bytes, None));
        }
        if format.is_none() {
            let missing = ArchiveFormat::LONGEST_MAGIC - head.len();
            head.extend_from_slice(&chunk[..missing.min(chunk.len())]);
            format = ArchiveFormat::detect(&head);
            if format.is_none() && head.len() == ArchiveFormat::LONGEST_MAGIC {
                drain(&mut stream, announced.unwrap_or(DRAIN_BYTES), patience).await;
                return Err(not_an_archive(&head));
            }
        }
        hasher.update(&chunk);
        if let Err(error) = writer.write_all(&chunk).await {
            drain(&mut stream, announced.unwrap_or(DRAIN_BYTES), patience).await;
            return Err(room::unwritten(error));
        }
    }
    if bytes == 0 {
        return Err(Problem::new(
            ProblemKind::InvalidRequest,
            "the body is empty; send the archive (.tar.gz, .tar.zst or .zip) as the request's body",
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

async fn next(
    stream: &mut BodyDataStream,
    patience: Duration,
) -> Result<Option<axum::body::Bytes>, Problem> {
    match tokio::time::timeout(patience, stream.next()).await {
        Ok(None) => Ok(None),
        Ok(Some(Ok(chunk))) => Ok(Some(chunk)),
        Ok(Some(Err(error))) => Err(Problem::new(
            ProblemKind::InvalidRequest,
            format!("the upload broke off ({error}); nothing was stored, send it again"),
        )),
        Err(_) => Err(Problem::new(
            ProblemKind::RequestTimeout,
            format!(
                "nothing came for {} s in the middle of the upload; nothing was stored, send it again",
                patience.as_secs_f64()
            ),
        )),
    }
}

/// Throws a body away that is refused before it is looked at.
pub(crate) async fn discard(body: Body, patience: Duration) {
    drain(&mut body.into_data_stream(), DRAIN_BYTES, patience).await;
}

/// Throws away what the client still sends, up to [`DRAIN_BYTES`].
async fn drain(stream: &mut BodyDataStream, at_most: u64, patience: Duration) {
    let mut left = at_most.min(DRAIN_BYTES);
    while left > 0 {
        match next(stream, patience).await {
            Ok(Some(chunk)) => left = left.saturating_sub(chunk.len() as u64),
            Ok(None) | Err(_) => return,
        }
    }
}

fn too_large(max_bytes: u64, announced: Option<u64>) -> Problem {
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
            "expected a .tar.gz, .tar.zst or .zip archive as the body; it begins with the bytes {}. \
             Send the archive itself, not a form and not text",
            hex::encode(head)
        ),
    )
}
