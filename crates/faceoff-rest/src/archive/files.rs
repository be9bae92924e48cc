//! The files of a season archive while it is prepared.

use faceoff_archive::Entry;
use faceoff_service::{free_space, problem::Problem};
use serde::Serialize;
use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

/// The files of an archive: their entries in its manifest, and the local files with their contents.
pub(super) struct Files {
    /// Where new files are created.
    folder: PathBuf,
    entries: Vec<Entry>,
    /// Path of the local file of each entry.
    local_paths: Vec<PathBuf>,
}

impl Files {
    /// An empty list; new files are created in `folder`.
    pub(super) fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            entries: Vec::new(),
            local_paths: Vec::new(),
        }
    }

    /// Writes a new file, and adds it to the archive as `path`.
    pub(super) async fn put(&mut self, path: &str, content: Vec<u8>) -> Result<(), Problem> {
        let local_path = self.new_path();
        let (bytes, blake3) = (content.len() as u64, blake3::hash(&content).to_string());
        tokio::fs::write(&local_path, content)
            .await
            .map_err(free_space::write_problem)?;
        self.add_hashed(path, local_path, bytes, blake3);
        Ok(())
    }

    /// Adds a JSON file with a response of the API.
    pub(super) async fn put_json(
        &mut self,
        path: &str,
        value: &impl Serialize,
    ) -> Result<(), Problem> {
        let json = serde_json::to_vec(value).map_err(Problem::internal)?;
        self.put(path, json).await
    }

    /// A path for a new file.
    pub(super) fn new_path(&self) -> PathBuf {
        self.folder.join(format!("file-{}", self.entries.len()))
    }

    /// Adds an existing local file to the archive as `path`, after reading it for its hash.
    pub(super) async fn add(&mut self, path: &str, local_path: PathBuf) -> Result<(), Problem> {
        let hashed = hash(local_path.clone()).await?;
        let (bytes, blake3) = hashed.map_err(Problem::internal)?;
        self.add_hashed(path, local_path, bytes, blake3);
        Ok(())
    }

    /// Adds an existing local file, whose length and hash are known, to the archive as `path`.
    pub(super) fn add_hashed(
        &mut self,
        path: &str,
        local_path: PathBuf,
        bytes: u64,
        blake3: String,
    ) {
        self.entries.push(Entry {
            path: path.to_owned(),
            bytes,
            blake3,
        });
        self.local_paths.push(local_path);
    }

    /// The entries of the manifest, and the path of the local file of each.
    pub(super) fn into_parts(self) -> (Vec<Entry>, Vec<PathBuf>) {
        (self.entries, self.local_paths)
    }
}

/// Length and hash of a file, or the error of reading it.
pub(super) async fn hash(path: PathBuf) -> Result<io::Result<(u64, String)>, Problem> {
    let read = move || {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(File::open(path)?)?;
        Ok((hasher.count(), hasher.finalize().to_string()))
    };
    tokio::task::spawn_blocking(read)
        .await
        .map_err(Problem::internal)
}
