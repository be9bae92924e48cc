//! Files that visitors download to develop agents on their own machines: the program, examples, a package.

use bytes::Bytes;
use std::{fs::File, io, path::PathBuf, sync::Arc, time::SystemTime};
use tokio::sync::Mutex;

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

/// The server's downloads. Their hashes are computed when they are first needed, and when a file has changed.
#[derive(Debug, Default)]
pub struct Downloads {
    offered: Vec<Download>,
    listed: Mutex<HashedDownloads>,
}

/// The list with sizes and hashes, as last computed.
#[derive(Debug, Default)]
struct HashedDownloads {
    /// Size and time of each file when it was read.
    versions: Vec<Option<FileVersion>>,
    downloads: Arc<[ListedDownload]>,
}

/// Size of a file in bytes, and time of its last change.
type FileVersion = (u64, Option<SystemTime>);

impl Downloads {
    /// Offers these files.
    pub fn new(offered: Vec<Download>) -> Self {
        Self {
            offered,
            listed: Mutex::default(),
        }
    }

    /// All files, with size and hash. A file that cannot be read any more is left out.
    pub async fn list(&self) -> Arc<[ListedDownload]> {
        let mut listed = self.listed.lock().await;
        let offered = self.offered.clone();
        let known_versions = std::mem::take(&mut listed.versions);
        let known_downloads = Arc::clone(&listed.downloads);
        let read = tokio::task::spawn_blocking(move || {
            let versions: Vec<_> = offered.iter().map(Download::version).collect();
            if versions == known_versions {
                return (versions, known_downloads);
            }
            let downloads = offered.into_iter().filter_map(|download| {
                let name = download.name.clone();
                ListedDownload::new(download)
                    .inspect_err(|error| tracing::warn!(name, %error, "a download cannot be read"))
                    .ok()
            });
            (versions, downloads.collect())
        });
        if let Ok((versions, downloads)) = read.await {
            *listed = HashedDownloads {
                versions,
                downloads,
            };
        }
        Arc::clone(&listed.downloads)
    }
}

impl Download {
    /// The version of the file; `None` for content in memory, and for a file that is missing.
    fn version(&self) -> Option<FileVersion> {
        let DownloadContent::File(path) = &self.content else {
            return None;
        };
        let metadata = path.metadata().ok()?;
        Some((metadata.len(), metadata.modified().ok()))
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
