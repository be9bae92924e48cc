//! Reads a dataset: the archive, the unpacked folder, or the folder that `faceoff eval` writes.
//!
//! Nothing is read before every file has been compared with its size and hash in the manifest, and
//! the archive with its seal, so that a damaged or truncated dataset is never half-read.

mod container;
mod episodes;
mod part;
mod steps;

pub use episodes::EpisodeRecord;
pub(crate) use episodes::{Columns, batches as episode_batches};
pub use steps::{StepBatches, StepTable};

use crate::recording::{
    EPISODES_FILE, LOG_FILE, MANIFEST_FILE, RESULTS_FILE, STEPS_FILE, VIOLATIONS_FILE,
};
use container::Container;
use faceoff_types::{EvaluationResult, RULESET};
use faceoff_wire::dataset::{DATASET_SCHEMA, DatasetManifest};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use part::Part;
use serde::Deserialize;
use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

/// The archive in the folder that `faceoff eval` writes.
const ARCHIVE: &str = "dataset.zip";

/// Every file of a dataset but its manifest.
const FILES: [&str; 5] = [
    STEPS_FILE,
    EPISODES_FILE,
    VIOLATIONS_FILE,
    RESULTS_FILE,
    LOG_FILE,
];

/// Why a dataset cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be read.
    #[error("{what}: {source}")]
    Io {
        /// What was attempted.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// It is no dataset, or not a whole one.
    #[error("not a readable dataset: {0}")]
    Unreadable(String),
    /// It is a dataset of another layout, ruleset or simulator.
    #[error("{0}")]
    Foreign(String),
    /// Its bytes are not those that were published.
    #[error("damaged or altered: {0}")]
    Altered(String),
}

impl DatasetError {
    pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::Io { what, source }
    }

    pub(crate) fn unreadable<E: std::fmt::Display>(
        what: impl Into<String>,
    ) -> impl FnOnce(E) -> Self {
        let what = what.into();
        move |error| Self::Unreadable(format!("{what}: {error}"))
    }
}

/// A dataset whose files are what its manifest says.
#[derive(Debug)]
pub struct Dataset {
    path: PathBuf,
    container: Container,
    manifest: DatasetManifest,
}

/// What can be told of a manifest of any layout.
#[derive(Deserialize)]
struct Layout {
    schema: String,
    ruleset: String,
}

impl Dataset {
    /// Opens `dataset.zip`, an unpacked folder, or a folder with a `dataset.zip`, and compares every
    /// file with its hash.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let metadata =
            fs::metadata(path).map_err(DatasetError::io(format!("opening {}", path.display())))?;
        let (path, container) = if metadata.is_dir() && path.join(MANIFEST_FILE).exists() {
            (path.to_owned(), Container::folder(path)?)
        } else if metadata.is_dir() {
            let archive = path.join(ARCHIVE);
            if !archive.exists() {
                return Err(DatasetError::Unreadable(format!(
                    "{} holds neither {MANIFEST_FILE} nor {ARCHIVE}",
                    path.display()
                )));
            }
            let container = Container::archive(&archive)?;
            same_results(&path.join(RESULTS_FILE), &container)?;
            (archive, container)
        } else {
            (path.to_owned(), Container::archive(path)?)
        };
        let manifest = manifest(&container)?;
        let dataset = Self {
            path,
            container,
            manifest,
        };
        dataset.check_files()?;
        Ok(dataset)
    }

    /// The archive or folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the dataset says about itself.
    #[must_use]
    pub const fn manifest(&self) -> &DatasetManifest {
        &self.manifest
    }

    /// The published score.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `results.json` is no score.
    pub fn results(&self) -> Result<EvaluationResult, DatasetError> {
        serde_json::from_slice(&self.bytes(RESULTS_FILE)?)
            .map_err(DatasetError::unreadable(RESULTS_FILE))
    }

    /// The episodes, in order.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if the table is not one of episodes.
    pub fn episodes(&self) -> Result<Vec<EpisodeRecord>, DatasetError> {
        episodes::read(self)
    }

    /// The table of control steps.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if the table is not one of control steps.
    pub fn steps(&self) -> Result<StepTable, DatasetError> {
        StepTable::open(self)
    }

    /// A small file's bytes.
    pub(crate) fn bytes(&self, name: &str) -> Result<Vec<u8>, DatasetError> {
        self.container.bytes(name)
    }

    /// One of the tables.
    pub(crate) fn table(
        &self,
        name: &str,
    ) -> Result<ParquetRecordBatchReaderBuilder<Part>, DatasetError> {
        ParquetRecordBatchReaderBuilder::try_new(self.container.part(name)?)
            .map_err(DatasetError::unreadable(name))
    }

    fn check_files(&self) -> Result<(), DatasetError> {
        let altered = |what| Err(DatasetError::Altered(what));
        let expected = BTreeSet::from(FILES);
        let listed: BTreeSet<&str> = self.manifest.files.keys().map(String::as_str).collect();
        if listed != expected {
            return altered(format!(
                "{MANIFEST_FILE} lists {listed:?}, expected {expected:?}"
            ));
        }
        self.container.expect_only(&FILES)?;
        for (name, digest) in &self.manifest.files {
            let found = self.container.digest(name)?;
            if &found != digest {
                return altered(format!(
                    "{name} has {} bytes and BLAKE3 {}, {MANIFEST_FILE} says {} bytes and {}",
                    found.bytes, found.blake3, digest.bytes, digest.blake3
                ));
            }
        }
        Ok(())
    }
}

fn manifest(container: &Container) -> Result<DatasetManifest, DatasetError> {
    let bytes = container.bytes(MANIFEST_FILE)?;
    // The layout first: a manifest of another one may lack fields.
    let layout: Layout =
        serde_json::from_slice(&bytes).map_err(DatasetError::unreadable(MANIFEST_FILE))?;
    if layout.schema != DATASET_SCHEMA {
        return Err(DatasetError::Foreign(format!(
            "the dataset's layout is {:?}, this version reads {DATASET_SCHEMA:?}",
            layout.schema
        )));
    }
    if layout.ruleset != RULESET {
        return Err(DatasetError::Foreign(format!(
            "the dataset was played by ruleset {:?}, this version knows {RULESET:?}",
            layout.ruleset
        )));
    }
    serde_json::from_slice(&bytes).map_err(DatasetError::unreadable(MANIFEST_FILE))
}

/// The score beside the archive, if there is one, is the one inside.
fn same_results(path: &Path, container: &Container) -> Result<(), DatasetError> {
    match fs::read(path) {
        Ok(beside) if beside == container.bytes(RESULTS_FILE)? => Ok(()),
        Ok(_) => Err(DatasetError::Altered(format!(
            "{} is not the {RESULTS_FILE} inside of {ARCHIVE}",
            path.display()
        ))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(DatasetError::io(format!("reading {}", path.display()))(
            error,
        )),
    }
}
