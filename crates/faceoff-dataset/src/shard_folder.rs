//! The folder of a shard's recording: writing, and reading with a check of all hashes. A shard is a range of episodes of one
//! task; the shards of an evaluation are joined to its dataset.

use crate::{
    digest,
    error::RecordingError,
    files::{
        CLIPS_FILE, EPISODES_FILE, LOG_FILE, REPORT_FILE, SHARD_FILE, STEPS_FILE, allow_missing,
        max_file_bytes,
    },
    shard::ShardReport,
    simulator::simulator_id,
    table::ShardTable,
};
use faceoff_episode::Simulator;
use faceoff_types::{Ruleset, printable_excerpt};
use faceoff_wire::{
    dataset::{FileDigest, SimulatorId},
    job::ShardSpec,
};
use fs_err::{self as fs, File};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    io::{self, ErrorKind, Read, Write},
    path::{Path, PathBuf},
};

/// Name and version of a shard folder's layout; private to the platform.
const SHARD_SCHEMA: &str = "faceoff-shard/5";
/// The previous layout, which has no clips.
const WITHOUT_CLIPS_SCHEMA: &str = "faceoff-shard/4";
/// Earlier layouts: 2, whose tables split integers by bytes and have no page index, and 3, whose steps have no column
/// for host interference (time that other programs on the evaluator's machine took). Evaluations that run during an
/// upgrade of the program have such shards.
const OLD_SHARD_SCHEMAS: [&str; 2] = ["faceoff-shard/2", "faceoff-shard/3"];

/// Characters that messages quote of a text in a recording.
const MAX_SHOWN_CHARS: usize = 80;

/// The files of a recorded shard.
pub const SHARD_FILES: [&str; 6] = [
    STEPS_FILE,
    EPISODES_FILE,
    LOG_FILE,
    REPORT_FILE,
    CLIPS_FILE,
    SHARD_FILE,
];

/// The files that `shard.json` lists.
const FILES: [&str; 5] = [STEPS_FILE, EPISODES_FILE, LOG_FILE, REPORT_FILE, CLIPS_FILE];

/// `shard.json`.
#[derive(Debug, Serialize, Deserialize)]
struct ShardFile {
    schema: String,
    ruleset: Ruleset,
    simulator: SimulatorId,
    spec: ShardSpec,
    files: BTreeMap<String, FileDigest>,
}

/// The folder of a shard that is being recorded.
#[derive(Debug)]
pub struct ShardFolder {
    dir: PathBuf,
}

impl ShardFolder {
    /// Creates the folder, or removes the files of an interrupted run.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn create(dir: &Path) -> Result<Self, RecordingError> {
        fs::create_dir_all(dir)?;
        let folder = Self {
            dir: dir.to_owned(),
        };
        for name in [SHARD_FILE].into_iter().chain(FILES) {
            for path in [dir.join(name), folder.partial(name)] {
                allow_missing(fs::remove_file(&path))?;
            }
        }
        Ok(folder)
    }

    /// Path of a file while it is incomplete.
    pub(crate) fn partial(&self, name: &str) -> PathBuf {
        self.dir.join(format!("{name}.partial"))
    }

    /// Writes report and log, gives all files their final names, and writes their hashes to `shard.json`.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn commit(
        &self,
        spec: &ShardSpec,
        report: &ShardReport,
        simulator: &dyn Simulator,
    ) -> Result<(), RecordingError> {
        self.write(LOG_FILE, report.log.as_bytes())?;
        self.write(REPORT_FILE, &json(report)?)?;
        let mut files = BTreeMap::new();
        for name in FILES {
            files.insert(name.to_owned(), digest::of_file(&self.partial(name))?);
            self.rename(name)?;
        }
        let shard = ShardFile {
            schema: SHARD_SCHEMA.to_owned(),
            ruleset: spec.ruleset,
            simulator: simulator_id(simulator),
            spec: spec.clone(),
            files,
        };
        self.write(SHARD_FILE, &json(&shard)?)?;
        self.rename(SHARD_FILE)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), RecordingError> {
        let mut file = File::create(self.partial(name))?;
        file.write_all(bytes)?;
        Ok(file.sync_all()?)
    }

    fn rename(&self, name: &str) -> Result<(), RecordingError> {
        Ok(fs::rename(self.partial(name), self.dir.join(name))?)
    }
}

fn json<T: Serialize>(value: &T) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = serde_json::to_vec(value).map_err(RecordingError::unusable("writing JSON"))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Reads a file that is held in memory, up to its [largest size](max_file_bytes).
fn read_small(path: &Path) -> io::Result<Vec<u8>> {
    let name = path.file_name().and_then(|name| name.to_str());
    let max = max_file_bytes(name.unwrap_or_default());
    let mut text = Vec::new();
    File::open(path)?.take(max + 1).read_to_end(&mut text)?;
    if text.len() as u64 > max {
        return Err(io::Error::new(
            ErrorKind::FileTooLarge,
            format!("larger than {max} bytes"),
        ));
    }
    Ok(text)
}

/// A complete shard folder whose files match their hashes.
#[derive(Debug)]
pub(crate) struct ShardRecording {
    pub spec: ShardSpec,
    pub report: ShardReport,
    pub steps: ShardTable,
    pub episodes: ShardTable,
    /// The shard's pack of clips, which replays show; `None` for earlier layouts.
    pub clips: Option<PathBuf>,
}

impl ShardRecording {
    /// Opens a folder and checks every file's size and hash.
    pub fn open(dir: &Path, simulator: &dyn Simulator) -> Result<Self, RecordingError> {
        let damaged = |problem: String| {
            RecordingError::Unusable(format!(
                "{} is damaged or incomplete: {problem}",
                dir.display()
            ))
        };
        let unreadable = |name: &'static str| {
            move |error: &dyn std::fmt::Display| damaged(format!("{name}: {error}"))
        };
        let text = read_small(&dir.join(SHARD_FILE)).map_err(|error| match error.kind() {
            ErrorKind::NotFound | ErrorKind::FileTooLarge => unreadable(SHARD_FILE)(&error),
            // An I/O error does not mean that the recording is damaged.
            _ => error.into(),
        })?;
        let shard: ShardFile =
            serde_json::from_slice(&text).map_err(|e| unreadable(SHARD_FILE)(&e))?;
        let table_at = match &*shard.schema {
            SHARD_SCHEMA | WITHOUT_CLIPS_SCHEMA => ShardTable::Current,
            old if OLD_SHARD_SCHEMAS.contains(&old) => ShardTable::Earlier,
            other => {
                return Err(damaged(format!(
                    "its layout is {:?}; this version joins {}, {WITHOUT_CLIPS_SCHEMA} and {SHARD_SCHEMA}",
                    printable_excerpt(other, MAX_SHOWN_CHARS),
                    OLD_SHARD_SCHEMAS.join(", ")
                )));
            }
        };
        if shard.ruleset != shard.spec.ruleset {
            return Err(damaged(format!(
                "it states the rulesets {} and {}",
                shard.ruleset, shard.spec.ruleset
            )));
        }
        if shard.simulator != simulator_id(simulator) {
            return Err(damaged(format!(
                "it was played by another build of the simulator, {}",
                printable_excerpt(&shard.simulator.version, MAX_SHOWN_CHARS)
            )));
        }
        let has_clips = shard.schema == SHARD_SCHEMA;
        let files = FILES.into_iter();
        for name in files.filter(|name| has_clips || *name != CLIPS_FILE) {
            let Some(expected) = shard.files.get(name) else {
                return Err(damaged(format!("{SHARD_FILE} does not list {name}")));
            };
            let path = dir.join(name);
            if !path.exists() {
                return Err(damaged(format!("{name} is missing")));
            }
            let found = digest::of_file(&path)?;
            if &found != expected {
                return Err(damaged(format!(
                    "{name} has {} bytes and hash {}, recorded were {} bytes and hash {}",
                    found.bytes, found.blake3, expected.bytes, expected.blake3
                )));
            }
        }
        let text = read_small(&dir.join(REPORT_FILE)).map_err(|error| match error.kind() {
            ErrorKind::FileTooLarge => unreadable(REPORT_FILE)(&error),
            _ => error.into(),
        })?;
        let report = serde_json::from_slice(&text).map_err(|e| unreadable(REPORT_FILE)(&e))?;
        Ok(Self {
            spec: shard.spec,
            report,
            steps: table_at(dir.join(STEPS_FILE)),
            episodes: table_at(dir.join(EPISODES_FILE)),
            clips: has_clips.then(|| dir.join(CLIPS_FILE)),
        })
    }
}
