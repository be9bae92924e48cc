//! Files that visitors download to develop agents on their own machines: the program, examples, a package.

use bytes::Bytes;
use std::{fs::File, io, path::PathBuf};
use tokio::sync::OnceCell;

/// A file that the server offers.
#[derive(Debug, Clone)]
pub struct Download {
    /// Its name, a single component of a path.
    pub name: String,
    /// What it is for, one sentence; empty if only its name says it.
    pub about: String,
    pub content: DownloadContent,
}

/// The bytes of a download.
#[derive(Debug, Clone)]
pub enum DownloadContent {
    /// A file, which is read for each download.
    File(PathBuf),
    Memory(Bytes),
}

/// A download with its size and hash, as the page lists it.
#[derive(Debug, Clone)]
pub struct ListedDownload {
    pub download: Download,
    pub bytes: u64,
    /// BLAKE3 hash of the content.
    pub blake3: blake3::Hash,
}

/// The server's downloads. Their hashes are computed when they are first needed.
#[derive(Debug, Default)]
pub struct Downloads {
    offered: Vec<Download>,
    listed: OnceCell<Vec<ListedDownload>>,
}

impl Downloads {
    /// Offers these files.
    pub fn new(offered: Vec<Download>) -> Self {
        Self {
            offered,
            listed: OnceCell::new(),
        }
    }

    /// All files, with size and hash. A file that cannot be read any more is left out.
    pub async fn list(&self) -> &[ListedDownload] {
        let listed = self.listed.get_or_init(async || {
            let offered = self.offered.clone();
            let listed = tokio::task::spawn_blocking(move || {
                offered
                    .into_iter()
                    .filter_map(|download| {
                        let name = download.name.clone();
                        let listed = ListedDownload::new(download);
                        listed
                            .inspect_err(
                                |error| tracing::warn!(name, %error, "a download cannot be read"),
                            )
                            .ok()
                    })
                    .collect()
            });
            listed.await.unwrap_or_default()
        });
        listed.await
    }
}

impl ListedDownload {
    fn new(download: Download) -> io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        match &download.content {
            DownloadContent::File(path) => hasher.update_reader(File::open(path)?)?,
            DownloadContent::Memory(bytes) => hasher.update(bytes),
        };
        Ok(Self {
            bytes: hasher.count(),
            blake3: hasher.finalize(),
            download,
        })
    }
}
