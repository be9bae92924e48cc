//! Files of the server, downloaded so that a download that broke off goes on where it was.

use super::{ApiError, Client};
use anyhow::{Context, anyhow, bail, ensure};
use futures::StreamExt;
use indicatif::ProgressBar;
use reqwest::{Method, Response, StatusCode, header};
use serde::Serialize;
use std::{
    fs::{self, File, TryLockError},
    io::{ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// The server's word for a file's hash.
const HASH: &str = "x-content-blake3";

/// A file that is there, whole.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Downloaded {
    pub file: PathBuf,
    pub bytes: u64,
    /// How much of it was there from a download that had broken off.
    pub resumed_at: u64,
    pub blake3: String,
    /// Is that the hash that the server tells? `false`: it tells none.
    pub checked: bool,
}

impl Client {
    /// Downloads what is at `path` to `file`; `published` is the hash that it has by another word than the answer's.
    ///
    /// What has come is in `FILE.part`, which stays if the connection breaks; `FILE.part.etag` says of what it is the
    /// beginning. A file that exists is replaced in the end.
    pub(super) async fn download(
        &self,
        path: &str,
        file: &Path,
        published: Option<&str>,
        bar: &ProgressBar,
    ) -> anyhow::Result<Downloaded> {
        let mut part = Part::open(file)?;
        let mut resumed_at = part.begun();
        let mut answer = self.ask_for(path, &part, resumed_at).await;
        if resumed_at > 0 && answer.as_ref().is_err_and(is_behind_the_end) {
            resumed_at = 0;
            answer = self.ask_for(path, &part, 0).await;
        }
        let response = answer?;
        if resumed_at > 0 && response.status() != StatusCode::PARTIAL_CONTENT {
            // It is another file by now, or the server sends whole ones alone.
            resumed_at = 0;
        }
        let told = Told::by(&response, resumed_at)?;
        part.write_from(resumed_at, told.tag.as_deref())?;
        bar.set_length(told.total.unwrap_or(0));
        bar.set_position(resumed_at);
        let mut bytes = resumed_at;
        let mut stream = response.bytes_stream();
        let mut broken = None;
        while let Some(piece) = stream.next().await {
            match piece {
                Ok(piece) => {
                    part.write(&piece)?;
                    bytes += piece.len() as u64;
                    bar.set_position(bytes);
                }
                Err(error) => {
                    broken = Some(error.without_url());
                    break;
                }
            }
        }
        if broken.is_some() || told.total.is_some_and(|total| total != bytes) {
            let next = if told.tag.is_some() {
                "the same command goes on from there"
            } else {
                "try again"
            };
            let words = format!("the download broke off after {bytes} bytes; {next}");
            return Err(match broken {
                Some(error) => anyhow!(error).context(words),
                None => anyhow!(super::Unreachable(words)),
            });
        }
        let expected = published.map(str::to_owned).or(told.hash);
        let blake3 = tokio::task::spawn_blocking(move || {
            part.settle(expected.as_deref())
                .map(|hash| (hash, expected.is_some()))
        })
        .await
        .context("reading what was downloaded")??;
        Ok(Downloaded {
            file: file.to_owned(),
            bytes,
            resumed_at,
            blake3: blake3.0,
            checked: blake3.1,
        })
    }

    async fn ask_for(&self, path: &str, part: &Part, from: u64) -> anyhow::Result<Response> {
        let mut request = self.request(Method::GET, path);
        if let (true, Some(tag)) = (from > 0, &part.tag) {
            request = request
                .header(header::RANGE, format!("bytes={from}-"))
                .header(header::IF_RANGE, tag);
        }
        self.send(request).await
    }
}

fn is_behind_the_end(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<ApiError>()
        .is_some_and(|error| error.status == StatusCode::RANGE_NOT_SATISFIABLE)
}

/// What an answer tells of the whole file.
struct Told {
    total: Option<u64>,
    /// A strong one: of one sequence of bytes.
    tag: Option<String>,
    hash: Option<String>,
}

impl Told {
    fn by(response: &Response, resumed_at: u64) -> anyhow::Result<Self> {
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
                .with_context(|| {
                    format!("the server sends the part {range:?} of a file, which is none")
                })?;
            ensure!(
                from == resumed_at,
                "the server was asked for a file from byte {resumed_at} on, and sends it from byte {from} on"
            );
            total.parse().ok()
        } else {
            response.content_length()
        };
        let tag = text("etag").filter(|tag| tag.starts_with('"'));
        // Either says it.
        let hash = text(HASH).or_else(|| {
            let tag = tag.as_deref()?.trim_matches('"');
            tag.strip_prefix("blake3-").map(str::to_owned)
        });
        Ok(Self { total, tag, hash })
    }
}

/// The beginning of a file, and what it is the beginning of.
struct Part {
    target: PathBuf,
    place: PathBuf,
    tag_place: PathBuf,
    tag: Option<String>,
    /// Held: two downloads of one file would write into each other's.
    file: File,
}

impl Part {
    fn open(target: &Path) -> anyhow::Result<Self> {
        let beside = |end: &str| {
            let mut name = target.as_os_str().to_owned();
            name.push(end);
            PathBuf::from(name)
        };
        let (place, tag_place) = (beside(".part"), beside(".part.etag"));
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&place)
            .with_context(|| format!("making {}", place.display()))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                bail!("another download to {} is under way", target.display())
            }
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("locking {}", place.display()));
            }
        }
        let tag = fs::read_to_string(&tag_place).ok();
        Ok(Self {
            target: target.to_owned(),
            place,
            tag_place,
            tag: tag.filter(|tag| tag.starts_with('"')),
            file,
        })
    }

    /// How much there is of a file that is known.
    fn begun(&self) -> u64 {
        match (&self.tag, self.file.metadata()) {
            (Some(_), Ok(metadata)) => metadata.len(),
            _ => 0,
        }
    }

    /// Keeps so much, and notes of what file it is.
    fn write_from(&mut self, at: u64, tag: Option<&str>) -> anyhow::Result<()> {
        let writing = || format!("writing {}", self.place.display());
        if at == 0 {
            // Nothing of another file under this one's name.
            match fs::remove_file(&self.tag_place) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(error).with_context(writing);
                }
                _ => {}
            }
        }
        self.file.set_len(at).with_context(writing)?;
        self.file.seek(SeekFrom::Start(at)).with_context(writing)?;
        if let (0, Some(tag)) = (at, tag) {
            fs::write(&self.tag_place, tag)
                .with_context(|| format!("writing {}", self.tag_place.display()))?;
        }
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> anyhow::Result<()> {
        self.file
            .write_all(piece)
            .with_context(|| format!("writing {}", self.place.display()))
    }

    /// Has it be the file, if it has the hash that it should; its hash.
    fn settle(mut self, expected: Option<&str>) -> anyhow::Result<String> {
        let reading = || format!("reading {}", self.place.display());
        self.file.seek(SeekFrom::Start(0)).with_context(reading)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(&self.file).with_context(reading)?;
        let hash = hasher.finalize().to_hex().to_string();
        if let Some(expected) = expected
            && !expected.eq_ignore_ascii_case(&hash)
        {
            self.remove();
            bail!(
                "what came has the BLAKE3 hash {hash}, and the server's file {expected}: it was changed on the way; nothing is \
                 kept of it, try again"
            );
        }
        fs::rename(&self.place, &self.target)
            .with_context(|| format!("naming {}", self.target.display()))?;
        // Without its file it says nothing.
        let _ = fs::remove_file(&self.tag_place);
        Ok(hash)
    }

    fn remove(&self) {
        // What stays is written anew.
        let _ = fs::remove_file(&self.tag_place);
        let _ = fs::remove_file(&self.place);
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // An empty one, of a refusal, is of no use to anybody.
        if self
            .file
            .metadata()
            .is_ok_and(|metadata| metadata.len() == 0)
            && self.place.exists()
        {
            let _ = fs::remove_file(&self.place);
        }
    }
}
