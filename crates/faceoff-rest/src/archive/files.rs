//! The files of an archive as they are gathered.

use faceoff_archive::Entry;
use faceoff_service::{problem::Problem, room};
use serde::Serialize;
use std::{
    fs::File,
    path::{Path, PathBuf},
};

/// Entries and where their content lies.
pub(super) struct Files {
    folder: PathBuf,
    entries: Vec<Entry>,
    places: Vec<PathBuf>,
}

impl Files {
    /// None yet; what is made lies in `folder`.
    pub(super) fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            entries: Vec::new(),
            places: Vec::new(),
        }
    }

    pub(super) async fn put(&mut self, path: &str, content: Vec<u8>) -> Result<(), Problem> {
        let place = self.fresh();
        let (bytes, blake3) = (content.len() as u64, blake3::hash(&content).to_string());
        tokio::fs::write(&place, content)
            .await
            .map_err(room::unwritten)?;
        self.add_known(path, place, bytes, blake3);
        Ok(())
    }

    /// Makes a file of JSON, as the API would send it.
    pub(super) async fn put_json(
        &mut self,
        path: &str,
        value: &impl Serialize,
    ) -> Result<(), Problem> {
        let json = serde_json::to_vec(value).map_err(Problem::internal)?;
        self.put(path, json).await
    }

    /// Where another file can be made.
    pub(super) fn fresh(&self) -> PathBuf {
        self.folder.join(format!("file-{}", self.entries.len()))
    }

    /// A file that lies somewhere: it is read for its hash.
    pub(super) async fn add(&mut self, path: &str, place: PathBuf) -> Result<(), Problem> {
        let (bytes, blake3) = hash(place.clone()).await?;
        self.add_known(path, place, bytes, blake3);
        Ok(())
    }

    /// A file that lies somewhere, with its hash.
    pub(super) fn add_known(&mut self, path: &str, place: PathBuf, bytes: u64, blake3: String) {
        self.entries.push(Entry {
            path: path.to_owned(),
            bytes,
            blake3,
        });
        self.places.push(place);
    }

    pub(super) fn into_parts(self) -> (Vec<Entry>, Vec<PathBuf>) {
        (self.entries, self.places)
    }
}

/// Length and hash of a file.
pub(super) async fn hash(place: PathBuf) -> Result<(u64, String), Problem> {
    let read = move || {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(File::open(place)?)?;
        Ok::<_, std::io::Error>((hasher.count(), hasher.finalize().to_string()))
    };
    tokio::task::spawn_blocking(read)
        .await
        .map_err(Problem::internal)?
        .map_err(Problem::internal)
}
