//! Reads a dataset, the recording of all episodes of an evaluation: the archive `dataset.zip`, an unpacked folder, or the
//! folder that `faceoff eval` writes.

mod container;
mod episodes;
mod file_range;
mod footer;
mod layout;
mod pages;
mod random_access;
mod seal;
mod steps;

pub use episodes::EpisodeRecord;
pub use layout::Layout;
pub use steps::{StepBatches, StepTable};

pub(crate) use container::Container;
pub(crate) use episodes::{Columns, batches as episode_batches};
pub(crate) use file_range::FileRange;
pub(crate) use footer::check_table;
pub(crate) use steps::{BATCH_ROWS, check_columns};

use crate::{
    digest,
    error::DatasetError,
    files::{
        ARCHIVE_FILE, CALIBRATION_FILE, EPISODES_FILE, LOG_FILE, MANIFEST_FILE, RESULTS_FILE,
        STEPS_FILE, VIOLATIONS_FILE,
    },
    table::HOST_INTERFERENCE,
};
use arrow_array::RecordBatch;
use faceoff_types::{Competition, EvaluationResult, MAX_EPISODES_PER_TASK, Task};
use faceoff_wire::dataset::{CalibrationFile, DatasetManifest, FileDigest, ViolationsFile};
use fs_err as fs;
use serde::Deserialize;
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

/// All files of a dataset except its manifest.
const FILES: [&str; 6] = [
    STEPS_FILE,
    EPISODES_FILE,
    VIOLATIONS_FILE,
    RESULTS_FILE,
    CALIBRATION_FILE,
    LOG_FILE,
];

/// A dataset whose files match its manifest.
#[derive(Debug)]
pub struct Dataset {
    path: PathBuf,
    container: Container,
    layout: Layout,
    manifest: DatasetManifest,
    hash_check: HashCheck,
    competition: Arc<Competition>,
}

/// When the dataset's files are compared with their hashes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HashCheck {
    /// All files when the dataset is opened.
    OnOpen,
    /// Each file when it is read.
    OnRead,
}

/// The field that manifests of all layouts have.
#[derive(Deserialize)]
struct ManifestSchema {
    schema: String,
}

impl Dataset {
    /// Opens a dataset of this competition: `dataset.zip`, an unpacked folder, or a folder with a `dataset.zip`, and compares every
    /// file with its hash, so that a damaged or truncated dataset is never partly read.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn open(path: &Path, competition: &Arc<Competition>) -> Result<Self, DatasetError> {
        let mut dataset = Self::open_lazily(path, competition)?;
        if dataset.layout == Layout::Two {
            dataset.container.check_seal()?;
        }
        FILES.iter().try_for_each(|name| dataset.check_hash(name))?;
        dataset.hash_check = HashCheck::OnOpen;
        Ok(dataset)
    }

    /// Like [`Dataset::open`], but each file is compared with its hash when it is read. Reading a few small files or
    /// one episode then does not need hundreds of megabytes.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn open_lazily(path: &Path, competition: &Arc<Competition>) -> Result<Self, DatasetError> {
        let (path, container) = if !fs::metadata(path)?.is_dir() {
            (path.to_owned(), Container::archive(path)?)
        } else if path.join(MANIFEST_FILE).exists() {
            (path.to_owned(), Container::Folder(path.to_owned()))
        } else {
            let archive = path.join(ARCHIVE_FILE);
            if !archive.exists() {
                return Err(DatasetError::Unreadable(format!(
                    "{} holds neither {MANIFEST_FILE} nor {ARCHIVE_FILE}",
                    path.display()
                )));
            }
            let container = Container::archive(&archive)?;
            container.check_results_copy(&path.join(RESULTS_FILE), ARCHIVE_FILE)?;
            (archive, container)
        };
        let (layout, manifest) = read_manifest(&container)?;
        let listed: BTreeSet<&str> = manifest.files.keys().map(String::as_str).collect();
        if listed != BTreeSet::from(FILES) {
            return Err(DatasetError::Altered(format!(
                "{MANIFEST_FILE} lists {listed:?}, expected {FILES:?}"
            )));
        }
        container.expect_only(&FILES)?;
        Ok(Self {
            path,
            container,
            layout,
            manifest,
            hash_check: HashCheck::OnRead,
            competition: competition.clone(),
        })
    }

    /// The layout of the dataset's files.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        self.layout
    }

    /// The dataset's manifest.
    #[must_use]
    pub const fn manifest(&self) -> &DatasetManifest {
        &self.manifest
    }

    /// Size and hash of the archive, which is read completely; `None` for an unpacked folder.
    ///
    /// # Errors
    /// [`DatasetError::Io`].
    pub fn archive(&self) -> Result<Option<FileDigest>, DatasetError> {
        match &self.container {
            Container::Folder(_) => Ok(None),
            Container::Archive { .. } => Ok(Some(digest::of_file(&self.path)?)),
        }
    }

    /// The published score.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `results.json` has another format.
    pub fn results(&self) -> Result<EvaluationResult, DatasetError> {
        serde_json::from_slice(&self.bytes(RESULTS_FILE)?)
            .map_err(DatasetError::unreadable(RESULTS_FILE))
    }

    /// Violations of each constraint, and slow answers.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `violations.json` has another format.
    pub fn violations(&self) -> Result<ViolationsFile, DatasetError> {
        serde_json::from_slice(&self.bytes(VIOLATIONS_FILE)?)
            .map_err(DatasetError::unreadable(VIOLATIONS_FILE))
    }

    /// The timing measurements of the slots.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `calibration.json` has another format.
    pub fn calibration(&self) -> Result<CalibrationFile, DatasetError> {
        serde_json::from_slice(&self.bytes(CALIBRATION_FILE)?)
            .map_err(DatasetError::unreadable(CALIBRATION_FILE))
    }

    /// The episodes, in order.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `episodes.parquet` is not a table of episodes, or does not have the number of
    /// episodes in the manifest.
    pub fn episodes(&self) -> Result<Vec<EpisodeRecord>, DatasetError> {
        let records = episodes::records(&self.episode_batches()?, &self.competition)?;
        for (task, expected) in &self.manifest.episodes {
            let found = records.iter().filter(|record| record.outcome.task == *task);
            let found = found.count();
            if found != *expected as usize {
                return Err(DatasetError::Unreadable(format!(
                    "{MANIFEST_FILE} states {expected} episodes of {task}, {EPISODES_FILE} has \
                     {found}"
                )));
            }
        }
        Ok(records)
    }

    /// The table of episodes as Arrow batches.
    pub(crate) fn episode_batches(&self) -> Result<Vec<RecordBatch>, DatasetError> {
        let counts = self.manifest.episodes.values();
        let expected_rows = counts.map(|count| u64::from(*count)).sum();
        episodes::batches(self.table(EPISODES_FILE)?, expected_rows, &self.competition)
    }

    /// The table of control steps.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `steps.parquet` is not a table of control steps.
    pub fn steps(&self) -> Result<StepTable, DatasetError> {
        let table = StepTable::open(self.table(STEPS_FILE)?, &self.competition)?;
        // Layout 4 added the column of host interference: the time that other programs on the evaluator's machine took.
        if self.layout == Layout::Four && !table.has_host_interference() {
            return Err(DatasetError::Unreadable(format!(
                "{STEPS_FILE} has no column {HOST_INTERFERENCE}"
            )));
        }
        Ok(table)
    }

    /// The control steps of one episode, with all columns or the named ones, in the file's order of columns. Little
    /// more than these rows is read: the table is not compared with its hash unless [`Dataset::open`] did so.
    ///
    /// # Errors
    /// [`DatasetError::Absent`] if the episode or a column does not exist, [`DatasetError::Unreadable`] if the table
    /// is damaged.
    pub fn episode(
        &self,
        task: Task,
        episode: u32,
        columns: Option<&[String]>,
    ) -> Result<RecordBatch, DatasetError> {
        match self.manifest.episodes.get(&task) {
            None => {
                return Err(DatasetError::Absent(format!(
                    "the dataset holds no episode of {task}"
                )));
            }
            Some(count) if episode >= *count => {
                return Err(DatasetError::Absent(format!(
                    "there is no episode {episode} of {task}: there are {count}, from 0"
                )));
            }
            Some(_) => {}
        }
        let range = self.range(STEPS_FILE)?;
        random_access::episode(range, task, episode, columns, &self.competition)
    }

    /// A small file's bytes.
    pub(crate) fn bytes(&self, name: &str) -> Result<Vec<u8>, DatasetError> {
        self.check_hash_on_read(name)?;
        self.container.bytes(name)
    }

    /// Opens a table after a check of its hash, unless that was checked before.
    fn table(&self, name: &str) -> Result<FileRange, DatasetError> {
        self.check_hash_on_read(name)?;
        self.range(name)
    }

    /// Opens a table after a check of its size against the manifest.
    fn range(&self, name: &str) -> Result<FileRange, DatasetError> {
        let (range, listed) = (self.container.range(name)?, &self.manifest.files[name]);
        if range.bytes == listed.bytes {
            return Ok(range);
        }
        Err(DatasetError::Altered(format!(
            "{name} has {} bytes, {MANIFEST_FILE} says {}",
            range.bytes, listed.bytes
        )))
    }

    fn check_hash_on_read(&self, name: &str) -> Result<(), DatasetError> {
        match self.hash_check {
            HashCheck::OnOpen => Ok(()),
            HashCheck::OnRead => self.check_hash(name),
        }
    }

    fn check_hash(&self, name: &str) -> Result<(), DatasetError> {
        let (listed, found) = (&self.manifest.files[name], self.container.digest(name)?);
        if found == *listed {
            return Ok(());
        }
        Err(DatasetError::Altered(format!(
            "{name} has {} bytes and BLAKE3 {}, {MANIFEST_FILE} says {} bytes and {}",
            found.bytes, found.blake3, listed.bytes, listed.blake3
        )))
    }
}

fn read_manifest(container: &Container) -> Result<(Layout, DatasetManifest), DatasetError> {
    let bytes = container.bytes(MANIFEST_FILE)?;
    // Check the layout first: a manifest of another layout may lack fields.
    let ManifestSchema { schema } =
        serde_json::from_slice(&bytes).map_err(DatasetError::unreadable(MANIFEST_FILE))?;
    let Some(layout) = Layout::from_schema(&schema) else {
        return Err(DatasetError::Foreign(format!(
            "the dataset's layout is {schema:?}, this version reads {}",
            Layout::schema_list()
        )));
    };
    let manifest: DatasetManifest =
        serde_json::from_slice(&bytes).map_err(DatasetError::unreadable(MANIFEST_FILE))?;
    let mut counts = manifest.episodes.iter();
    if let Some((task, count)) = counts.find(|(_, count)| **count > MAX_EPISODES_PER_TASK) {
        return Err(DatasetError::Unreadable(format!(
            "{MANIFEST_FILE} states {count} episodes of {task}; at most {MAX_EPISODES_PER_TASK} are possible"
        )));
    }
    Ok((layout, manifest))
}
