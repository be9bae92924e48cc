//! Artifacts: the files of the season (bundles, recordings, datasets) in an object store. The database names each one by
//! its key. Two kinds are for replays in the browser: *clips* are the recorded motions of a dataset's episodes. An *ablation*
//! evaluates a submission without perturbations, with each one alone, and with all; its *parts* are the clips of its single shards,
//! until they are merged.
//!
//! A *folder* of artifacts is all that have a common key prefix, which ends before a slash.

use crate::{
    boxed_future,
    error::{Result, StoreError},
};
use bytes::Bytes;
use faceoff_types::{AblationId, Profile, Task};
use futures::{StreamExt, TryStreamExt, stream::BoxStream};
use jiff::Timestamp;
use object_store::{
    GetOptions, ObjectStore, ObjectStoreExt, WriteMultipart, local::LocalFileSystem,
    path::Path as Key,
};
use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
    time::SystemTime,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

/// The bytes of an artifact, in order, in pieces.
pub type ArtifactStream = BoxStream<'static, Result<Bytes>>;

/// Suffix of the key of a dataset's clips, which are stored and deleted with the dataset.
const CLIPS_SUFFIX: &str = ".clips";

/// Key prefix of the clips of running ablations.
const ABLATION_PARTS_PREFIX: &str = "ablation-parts";

/// Bytes in memory per piece of a copy.
const PIECE_BYTES: usize = 1 << 20;

/// Artifact files (bundles, shard recordings, datasets) in an object store. Keys are slash-separated
/// names; empty parts and `..` are refused.
#[derive(Debug, Clone)]
pub struct Artifacts {
    objects: Arc<dyn ObjectStore>,
    folder: Arc<Path>,
}

/// The clips of a shard of an ablation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AblationPart {
    /// The perturbations under which the shard was played.
    pub profile: Profile,
    pub task: Task,
    /// The shard's first episode.
    pub first_episode: u32,
    /// The artifact's key.
    pub key: String,
}

impl Artifacts {
    /// Opens the artifacts of a folder, which is created if necessary.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder)
            .map_err(|error| StoreError::Artifacts(format!("{}: {error}", folder.display())))?;
        // A database row must never name an artifact that a power cut has lost: file and folder are
        // synced to disk before a put returns.
        let objects = LocalFileSystem::new_with_prefix(folder)
            .map_err(artifact_error)?
            .with_fsync(true)
            .with_automatic_cleanup(true);
        Ok(Self {
            objects: Arc::new(objects),
            folder: folder.into(),
        })
    }

    /// Stores a copy of a file under `key`, replacing an earlier one. It appears whole or not at all,
    /// even if the process is killed.
    #[boxed_future]
    pub async fn put_file(&self, key: &str, file: &Path) -> Result<()> {
        let io_error = |error: std::io::Error| StoreError::artifact(file.display(), &error);
        let mut source = tokio::fs::File::open(file).await.map_err(io_error)?;
        let upload = self
            .objects
            .put_multipart(&parse_key(key)?)
            .await
            .map_err(artifact_error)?;
        let mut upload = WriteMultipart::new_with_chunk_size(upload, PIECE_BYTES);
        let mut piece = vec![0; PIECE_BYTES];
        loop {
            let read = match source.read(&mut piece).await {
                Ok(0) => break,
                Ok(read) => read,
                Err(error) => {
                    upload.abort().await.map_err(artifact_error)?;
                    return Err(io_error(error));
                }
            };
            upload.write(&piece[..read]);
            // limits memory when the disk is slower than the source
            upload.wait_for_capacity(2).await.map_err(artifact_error)?;
        }
        upload.finish().await.map_err(artifact_error)?;
        Ok(())
    }

    /// Stores bytes under `key`, replacing an earlier artifact; they appear whole or not at all.
    #[boxed_future]
    pub async fn put_bytes(&self, key: &str, bytes: Vec<u8>) -> Result<()> {
        let key = parse_key(key)?;
        let put = self.objects.put(&key, bytes.into());
        put.await.map_err(artifact_error)?;
        Ok(())
    }

    /// Stores a dataset, and before it the clips for its replays, so that a stored dataset always has them.
    #[boxed_future]
    pub async fn put_dataset(&self, key: &str, archive: &Path, clips: Option<&Path>) -> Result<()> {
        if let Some(clips) = clips {
            self.put_file(&Self::clips_key(key), clips).await?;
        }
        self.put_file(key, archive).await
    }

    /// The key of the clips for a dataset's replays. Datasets of older versions have none.
    #[must_use]
    pub fn clips_key(dataset: &str) -> String {
        format!("{dataset}{CLIPS_SUFFIX}")
    }

    /// Removes a dataset and its clips. Missing ones are no error.
    #[boxed_future]
    pub async fn delete_dataset(&self, key: &str) -> Result<()> {
        self.delete(&Self::clips_key(key)).await?;
        self.delete(key).await
    }

    /// The key of the clips of an ablation's shard, which are stored until all shards are played.
    #[must_use]
    pub fn ablation_part_key(
        id: AblationId,
        profile: Profile,
        task: Task,
        first_episode: u32,
    ) -> String {
        format!(
            "{}/{profile}.{task}.{first_episode}",
            Self::ablation_parts_prefix(id)
        )
    }

    /// The key prefix of all clips of an ablation's shards.
    #[must_use]
    pub fn ablation_parts_prefix(id: AblationId) -> String {
        format!("{ABLATION_PARTS_PREFIX}/{id}")
    }

    /// The key of the clips of a finished ablation's episodes in a profile.
    #[must_use]
    pub fn ablation_clips_key(id: AblationId, profile: Profile) -> String {
        format!("ablations/{id}/{profile}{CLIPS_SUFFIX}")
    }

    /// The ablations that have parts (clips of shards).
    #[boxed_future]
    pub async fn ablations_with_parts(&self) -> Result<Vec<AblationId>> {
        let folder = parse_key(ABLATION_PARTS_PREFIX)?;
        let listing = self.objects.list_with_delimiter(Some(&folder));
        let folders = listing.await.map_err(artifact_error)?.common_prefixes;
        let ids = folders
            .iter()
            .filter_map(|folder| folder.filename()?.parse().ok());
        Ok(ids.collect())
    }

    /// The parts (clips of shards) of an ablation, in any order.
    #[boxed_future]
    pub async fn list_ablation_parts(&self, id: AblationId) -> Result<Vec<AblationPart>> {
        let folder = parse_key(&Self::ablation_parts_prefix(id))?;
        let listing = self.objects.list_with_delimiter(Some(&folder));
        let parts = listing.await.map_err(artifact_error)?.objects;
        let parts = parts.iter().filter_map(|part| {
            let mut name = part.location.filename()?.split('.');
            Some(AblationPart {
                profile: name.next()?.parse().ok()?,
                task: name.next()?.parse().ok()?,
                first_episode: name.next()?.parse().ok()?,
                key: part.location.to_string(),
            })
        });
        Ok(parts.collect())
    }

    /// Copies an artifact to a new file and flushes it to disk.
    #[boxed_future]
    pub async fn get_to_file(&self, key: &str, file: &Path) -> Result<()> {
        let (bytes, mut stream) = self.read(key).await?;
        let io_error = |error: std::io::Error| StoreError::artifact(file.display(), &error);
        let mut target = tokio::fs::File::create(file).await.map_err(io_error)?;
        let mut written = 0;
        while let Some(piece) = stream.try_next().await? {
            target.write_all(&piece).await.map_err(io_error)?;
            written += piece.len() as u64;
        }
        target.flush().await.map_err(io_error)?;
        if written == bytes {
            Ok(())
        } else {
            Err(StoreError::Artifacts(format!(
                "{key}: {written} of {bytes} bytes read"
            )))
        }
    }

    /// The path of an artifact's file, for callers that read pieces of it. It must not be written to.
    ///
    /// # Errors
    /// [`StoreError::Artifacts`] if `key` is not a valid key.
    pub fn local_path(&self, key: &str) -> Result<PathBuf> {
        Ok(self.folder.join(parse_key(key)?.as_ref()))
    }

    /// Length of an artifact, in bytes; `None` if it does not exist.
    #[boxed_future]
    pub async fn size_bytes(&self, key: &str) -> Result<Option<u64>> {
        match self.objects.head(&parse_key(key)?).await {
            Ok(object) => Ok(Some(object.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(artifact_error(error)),
        }
    }

    /// Length and bytes of an artifact, for a download.
    #[boxed_future]
    pub async fn read(&self, key: &str) -> Result<(u64, ArtifactStream)> {
        let object = self
            .objects
            .get(&parse_key(key)?)
            .await
            .map_err(artifact_error)?;
        let bytes = object.meta.size;
        Ok((bytes, object.into_stream().map_err(artifact_error).boxed()))
    }

    /// A range of an artifact's bytes, for a download. Only these are read.
    #[boxed_future]
    pub async fn read_range(&self, key: &str, range: Range<u64>) -> Result<ArtifactStream> {
        let options = GetOptions::new().with_range(Some(range));
        let object = self
            .objects
            .get_opts(&parse_key(key)?, options)
            .await
            .map_err(artifact_error)?;
        Ok(object.into_stream().map_err(artifact_error).boxed())
    }

    /// Removes an artifact; one that does not exist is no error, so that a removal can be repeated.
    #[boxed_future]
    pub async fn delete(&self, key: &str) -> Result<()> {
        match self.objects.delete(&parse_key(key)?).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(artifact_error(error)),
        }
    }

    /// Stores every file directly in `folder` as `prefix/NAME`.
    #[boxed_future]
    pub async fn put_folder(&self, prefix: &str, folder: &Path) -> Result<()> {
        let io_error = |error: std::io::Error| StoreError::artifact(folder.display(), &error);
        let mut entries = tokio::fs::read_dir(folder).await.map_err(io_error)?;
        while let Some(entry) = entries.next_entry().await.map_err(io_error)? {
            let name = entry.file_name();
            let name = name.to_str().ok_or_else(|| {
                StoreError::Artifacts(format!("{}: not a UTF-8 name", entry.path().display()))
            })?;
            self.put_file(&format!("{prefix}/{name}"), &entry.path())
                .await?;
        }
        Ok(())
    }

    /// Copies every artifact `prefix/NAME` to `folder/NAME`. [`StoreError::NotFound`] if none exists.
    #[boxed_future]
    pub async fn get_folder(&self, prefix: &str, folder: &Path) -> Result<()> {
        let listing = self
            .objects
            .list_with_delimiter(Some(&parse_key(prefix)?))
            .await
            .map_err(artifact_error)?;
        if listing.objects.is_empty() {
            return Err(StoreError::NotFound("artifact"));
        }
        for object in listing.objects {
            let name = object.location.filename().unwrap_or_default();
            self.get_to_file(object.location.as_ref(), &folder.join(name))
                .await?;
        }
        Ok(())
    }

    /// The keys of all artifacts under `prefix/` that were stored at `until` or earlier, by the times of the files.
    pub(crate) async fn stored_until(&self, prefix: &str, until: Timestamp) -> Result<Vec<String>> {
        let until = until.as_millisecond();
        self.objects
            .list(Some(&parse_key(prefix)?))
            .try_filter(|object| {
                std::future::ready(object.last_modified.timestamp_millis() <= until)
            })
            .map_ok(|object| object.location.to_string())
            .try_collect()
            .await
            .map_err(artifact_error)
    }

    /// Removes every artifact under `prefix/`.
    #[boxed_future]
    pub async fn delete_folder(&self, prefix: &str) -> Result<()> {
        self.delete_others(prefix, "").await
    }

    /// Removes every artifact under `prefix/` except the one with the key `kept_key`, those under `kept_key/`, and the
    /// clips of the dataset `kept_key`.
    #[boxed_future]
    pub async fn delete_others(&self, prefix: &str, kept_key: &str) -> Result<()> {
        let listing: Vec<_> = self
            .objects
            .list(Some(&parse_key(prefix)?))
            .map_ok(|object| object.location)
            .try_collect()
            .await
            .map_err(artifact_error)?;
        for location in listing {
            let is_kept = location
                .as_ref()
                .strip_prefix(kept_key)
                .is_some_and(|rest| {
                    let belongs_to_kept_key =
                        rest.is_empty() || rest.starts_with('/') || rest == CLIPS_SUFFIX;
                    belongs_to_kept_key && !kept_key.is_empty()
                });
            if !is_kept {
                self.delete(location.as_ref()).await?;
            }
        }
        Ok(())
    }

    /// Removes incomplete files that a killed process has left, if they were started before `before`.
    /// Returns the number of files.
    #[boxed_future]
    pub async fn remove_abandoned(&self, before: Timestamp) -> Result<usize> {
        let folder = Arc::clone(&self.folder);
        tokio::task::spawn_blocking(move || remove_incomplete(&folder, before.into()))
            .await
            .unwrap_or_else(|panic| Err(std::io::Error::other(panic)))
            .map_err(|error| StoreError::Artifacts(format!("removing half-written files: {error}")))
    }
}

/// Removes the incomplete files in a folder. `LocalFileSystem` writes to `NAME#NUMBER` beside the file and renames that when it
/// is complete; its keys cannot contain a `#`.
fn remove_incomplete(folder: &Path, before: SystemTime) -> std::io::Result<usize> {
    let mut removed = 0;
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            removed += remove_incomplete(&entry.path(), before)?;
            continue;
        }
        let name = entry.file_name();
        let is_incomplete = name
            .to_str()
            .and_then(|name| name.rsplit_once('#'))
            .is_some_and(|(_, number)| {
                !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
            });
        if is_incomplete && entry.metadata()?.modified()? < before {
            std::fs::remove_file(entry.path())?;
            removed += 1;
        }
    }
    Ok(removed)
}

fn parse_key(key: &str) -> Result<Key> {
    Key::parse(key).map_err(|error| StoreError::Artifacts(format!("key {key:?}: {error}")))
}

fn artifact_error(error: object_store::Error) -> StoreError {
    match error {
        object_store::Error::NotFound { .. } => StoreError::NotFound("artifact"),
        error => StoreError::artifact("storing or reading", &error),
    }
}
