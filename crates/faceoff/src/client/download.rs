//! Resumable downloads of files. An interrupted download leaves a partial file, which the next one continues if the
//! server's ETag, which identifies one content of a file, is still the same.

use super::{Client, is_refused_with, with_suffix};
use anyhow::{Context, anyhow, bail, ensure};
use faceoff_dataset::allow_missing;
use futures::StreamExt;
use indicatif::ProgressBar;
use reqwest::{Method, Response, StatusCode, header};
use serde::Serialize;
use std::{
    fs::{self, File, TryLockError},
    io::{Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Response header with the hexadecimal BLAKE3 hash of a file.
const HASH_HEADER: &str = "x-content-blake3";

/// A complete downloaded file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DownloadedFile {
    pub file: PathBuf,
    pub bytes: u64,
    /// Bytes of an earlier, interrupted download that were kept; 0 if the file was downloaded from its beginning.
    pub resumed_at: u64,
    pub blake3: String,
    /// Was the hash compared with the expected one? It was not if neither the caller nor the server had named one.
    pub checked: bool,
}

impl Client {
    /// Downloads `path` to `file`. `expected_blake3` is the expected hash, if the caller knows it from elsewhere than the
    /// response.
    ///
    /// Received bytes go to `FILE.part`, which stays if the connection breaks; `FILE.part.etag` has the ETag of its
    /// source. An existing file is replaced once the download is complete.
    pub(super) async fn download(
        &self,
        path: &str,
        file: &Path,
        expected_blake3: Option<&str>,
        bar: &ProgressBar,
    ) -> anyhow::Result<DownloadedFile> {
        let mut part = PartialFile::open(file)?;
        let mut resumed_at = part.resumable_bytes();
        let mut answer = self.request_file(path, &part, resumed_at).await;
        let is_past_the_end =
            |error: &anyhow::Error| is_refused_with(error, StatusCode::RANGE_NOT_SATISFIABLE);
        if resumed_at > 0 && answer.as_ref().is_err_and(is_past_the_end) {
            resumed_at = 0;
            answer = self.request_file(path, &part, 0).await;
        }
        let response = answer?;
        if resumed_at > 0 && response.status() != StatusCode::PARTIAL_CONTENT {
            // The file has changed meanwhile, or the server does not support ranges.
            resumed_at = 0;
        }
        let info = FileInfo::from_response(&response, resumed_at)?;
        part.truncate_to(resumed_at, info.tag.as_deref())?;
        bar.set_length(info.total.unwrap_or(0));
        bar.set_position(resumed_at);
        let mut bytes = resumed_at;
        let mut stream = response.bytes_stream();
        let mut stream_error = None;
        while let Some(piece) = stream.next().await {
            match piece {
                Ok(piece) => {
                    part.write(&piece)?;
                    bytes += piece.len() as u64;
                    bar.set_position(bytes);
                }
                Err(error) => {
                    stream_error = Some(error.without_url());
                    break;
                }
            }
        }
        if stream_error.is_some() || info.total.is_some_and(|total| total != bytes) {
            let advice = if info.tag.is_some() {
                "run the same command again to resume it"
            } else {
                "try again"
            };
            let message = format!("the download was interrupted after {bytes} bytes; {advice}");
            return Err(match stream_error {
                Some(error) => anyhow!(error).context(message),
                None => anyhow!(super::Unreachable(message)),
            });
        }
        let expected = expected_blake3.map(str::to_owned).or(info.hash);
        let (blake3, checked) = tokio::task::spawn_blocking(move || {
            part.finish(expected.as_deref())
                .map(|hash| (hash, expected.is_some()))
        })
        .await
        .context("reading the downloaded file")??;
        Ok(DownloadedFile {
            file: file.to_owned(),
            bytes,
            resumed_at,
            blake3,
            checked,
        })
    }

    async fn request_file(
        &self,
        path: &str,
        part: &PartialFile,
        first_byte: u64,
    ) -> anyhow::Result<Response> {
        let mut request = self.request(Method::GET, path);
        if let (true, Some(tag)) = (first_byte > 0, &part.tag) {
            request = request
                .header(header::RANGE, format!("bytes={first_byte}-"))
                .header(header::IF_RANGE, tag);
        }
        self.send(request).await
    }
}

/// Headers of a response that describe the complete file.
struct FileInfo {
    /// Length in bytes.
    total: Option<u64>,
    /// A strong ETag, which identifies one sequence of bytes.
    tag: Option<String>,
    /// BLAKE3, hexadecimal.
    hash: Option<String>,
}

impl FileInfo {
    fn from_response(response: &Response, resumed_at: u64) -> anyhow::Result<Self> {
        let text = |name: &str| {
            let value = response.headers().get(name)?;
            value.to_str().ok().map(str::to_owned)
        };
        let total = if response.status() == StatusCode::PARTIAL_CONTENT {
            let range = text("content-range").unwrap_or_default();
            let (from, total) = range
                .strip_prefix("bytes ")
                .and_then(|range| range.split_once('/'))
                .and_then(|(part, total)| {
                    Some((part.split_once('-')?.0.parse::<u64>().ok()?, total))
                })
                .with_context(|| format!("the server sent the invalid content range {range:?}"))?;
            ensure!(
                from == resumed_at,
                "the server was asked for the file from byte {resumed_at}, but sent it from byte {from}"
            );
            total.parse().ok()
        } else {
            response.content_length()
        };
        let tag = text("etag").filter(|tag| tag.starts_with('"'));
        // Some responses have the hash only in the ETag.
        let hash = text(HASH_HEADER).or_else(|| {
            let tag = tag.as_deref()?.trim_matches('"');
            tag.strip_prefix("blake3-").map(str::to_owned)
        });
        Ok(Self { total, tag, hash })
    }
}

/// The part of a file that has been received, and the ETag of its source.
struct PartialFile {
    /// Path of the complete file.
    target: PathBuf,
    /// Path of the partial file, `TARGET.part`.
    path: PathBuf,
    /// Path of the file with the ETag, `TARGET.part.etag`.
    tag_path: PathBuf,
    tag: Option<String>,
    /// Locked, because two downloads of one file would overwrite each other.
    file: File,
}

impl PartialFile {
    fn open(target: &Path) -> anyhow::Result<Self> {
        let path = with_suffix(target, ".part");
        let tag_path = with_suffix(target, ".part.etag");
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .with_context(|| format!("creating {}", path.display()))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                bail!("another download to {} is running", target.display())
            }
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("locking {}", path.display()));
            }
        }
        let tag = fs::read_to_string(&tag_path).ok();
        Ok(Self {
            target: target.to_owned(),
            path,
            tag_path,
            tag: tag.filter(|tag| tag.starts_with('"')),
            file,
        })
    }

    /// Bytes that a download can be resumed from: 0 if their source is unknown.
    fn resumable_bytes(&self) -> u64 {
        match (&self.tag, self.file.metadata()) {
            (Some(_), Ok(metadata)) => metadata.len(),
            _ => 0,
        }
    }

    /// Keeps the first `length` bytes and records the ETag of their source.
    fn truncate_to(&mut self, length: u64, tag: Option<&str>) -> anyhow::Result<()> {
        let writing = || format!("writing {}", self.path.display());
        if length == 0 {
            // The old ETag does not describe the new file.
            allow_missing(fs::remove_file(&self.tag_path)).with_context(writing)?;
        }
        self.file.set_len(length).with_context(writing)?;
        self.file
            .seek(SeekFrom::Start(length))
            .with_context(writing)?;
        if let (0, Some(tag)) = (length, tag) {
            fs::write(&self.tag_path, tag)
                .with_context(|| format!("writing {}", self.tag_path.display()))?;
        }
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> anyhow::Result<()> {
        self.file
            .write_all(piece)
            .with_context(|| format!("writing {}", self.path.display()))
    }

    /// Moves the file to its target, if it has the expected hash, and returns its hash.
    fn finish(mut self, expected: Option<&str>) -> anyhow::Result<String> {
        let reading = || format!("reading {}", self.path.display());
        self.file.seek(SeekFrom::Start(0)).with_context(reading)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(&self.file).with_context(reading)?;
        let hash = hasher.finalize().to_hex().to_string();
        if let Some(expected) = expected
            && !expected.eq_ignore_ascii_case(&hash)
        {
            self.remove();
            bail!(
                "the download has the BLAKE3 hash {hash}, but the server's file has {expected}: it was damaged in transfer and is \
                deleted; try again"
            );
        }
        fs::rename(&self.path, &self.target)
            .with_context(|| format!("naming {}", self.target.display()))?;
        // The ETag is useless without the partial file.
        let _ = fs::remove_file(&self.tag_path);
        Ok(hash)
    }

    fn remove(&self) {
        // A file that cannot be removed is overwritten by the next download.
        let _ = fs::remove_file(&self.tag_path);
        let _ = fs::remove_file(&self.path);
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        // A download that the server refuses has created an empty partial file.
        if self
            .file
            .metadata()
            .is_ok_and(|metadata| metadata.len() == 0)
            && self.path.exists()
        {
            let _ = fs::remove_file(&self.path);
        }
    }
}
