use super::{EPISODES_FILE, LOG_FILE, STEPS_FILE, digest};
use crate::{PlatformFault, ShardReport, ShardSpec, simulator::simulator_id};
use faceoff_wire::dataset::{FileDigest, SimulatorId};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};

const REPORT_FILE: &str = "report.json";
/// Written last: a folder with this file is complete.
const SHARD_FILE: &str = "shard.json";
/// Name and version of a shard folder's layout; private to the platform.
const SHARD_SCHEMA: &str = "faceoff-shard/2";

/// `shard.json`.
#[derive(Debug, Serialize, Deserialize)]
struct ShardFile {
    schema: String,
    ruleset: String,
    simulator: SimulatorId,
    spec: ShardSpec,
    files: BTreeMap<String, FileDigest>,
}

/// A folder in which a shard is being recorded.
#[derive(Debug)]
pub(crate) struct ShardFolder {
    dir: PathBuf,
}

impl ShardFolder {
    /// Creates the folder, or empties it of what an interrupted run has left.
    pub fn create(dir: &Path) -> Result<Self, PlatformFault> {
        fs::create_dir_all(dir)
            .map_err(PlatformFault::io(format!("creating {}", dir.display())))?;
        let folder = Self {
            dir: dir.to_owned(),
        };
        for name in [SHARD_FILE, STEPS_FILE, EPISODES_FILE, LOG_FILE, REPORT_FILE] {
            for path in [dir.join(name), folder.partial(name)] {
                match fs::remove_file(&path) {
                    Ok(()) => {}
                    Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                    Err(source) => {
                        return Err(PlatformFault::Io {
                            what: format!("removing {}", path.display()),
                            source,
                        });
                    }
                }
            }
        }
        Ok(folder)
    }

    /// Where a file is written before it is complete.
    pub fn partial(&self, name: &str) -> PathBuf {
        self.dir.join(format!("{name}.partial"))
    }

    /// Adds report and log, gives all files their names, and states their hashes.
    pub fn commit(&self, spec: &ShardSpec, report: &ShardReport) -> Result<(), PlatformFault> {
        self.write(LOG_FILE, report.log.as_bytes())?;
        self.write(REPORT_FILE, &json(report)?)?;
        let mut files = BTreeMap::new();
        for name in [STEPS_FILE, EPISODES_FILE, LOG_FILE, REPORT_FILE] {
            files.insert(name.to_owned(), digest::of_file(&self.partial(name))?);
            self.rename(name)?;
        }
        let shard = ShardFile {
            schema: SHARD_SCHEMA.to_owned(),
            ruleset: faceoff_types::RULESET.to_owned(),
            simulator: simulator_id().clone(),
            spec: spec.clone(),
            files,
        };
        self.write(SHARD_FILE, &json(&shard)?)?;
        self.rename(SHARD_FILE)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), PlatformFault> {
        let path = self.partial(name);
        let writing = || PlatformFault::io(format!("writing {}", path.display()));
        let mut file = File::create(&path).map_err(writing())?;
        file.write_all(bytes)
            .and_then(|()| file.sync_all())
            .map_err(writing())
    }

    fn rename(&self, name: &str) -> Result<(), PlatformFault> {
        fs::rename(self.partial(name), self.dir.join(name)).map_err(PlatformFault::io(format!(
            "renaming {name} in {}",
            self.dir.display()
        )))
    }
}

fn json<T: Serialize>(value: &T) -> Result<Vec<u8>, PlatformFault> {
    let mut bytes = serde_json::to_vec(value).map_err(PlatformFault::recording("writing JSON"))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// A complete shard folder whose files are what was recorded.
#[derive(Debug)]
pub(crate) struct ShardRecording {
    pub spec: ShardSpec,
    pub report: ShardReport,
    pub steps: PathBuf,
    pub episodes: PathBuf,
}

impl ShardRecording {
    /// Opens a folder and checks every file's size and hash.
    pub fn open(dir: &Path) -> Result<Self, PlatformFault> {
        let damaged = |what: String| {
            PlatformFault::Recording(format!(
                "{} is damaged or incomplete: {what}",
                dir.display()
            ))
        };
        let text =
            fs::read(dir.join(SHARD_FILE)).map_err(|e| damaged(format!("{SHARD_FILE}: {e}")))?;
        let shard: ShardFile =
            serde_json::from_slice(&text).map_err(|e| damaged(format!("{SHARD_FILE}: {e}")))?;
        if shard.schema != SHARD_SCHEMA || shard.ruleset != faceoff_types::RULESET {
            return Err(damaged(format!(
                "made with {} and {}; this is {SHARD_SCHEMA} and {}",
                shard.schema,
                shard.ruleset,
                faceoff_types::RULESET
            )));
        }
        if &shard.simulator != simulator_id() {
            return Err(damaged(format!(
                "it was played by another build of the simulator, {}",
                shard.simulator.version
            )));
        }
        for name in [STEPS_FILE, EPISODES_FILE, LOG_FILE, REPORT_FILE] {
            let Some(expected) = shard.files.get(name) else {
                return Err(damaged(format!("{SHARD_FILE} does not know {name}")));
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
        let text = fs::read(dir.join(REPORT_FILE)).map_err(PlatformFault::io(format!(
            "reading {}",
            dir.join(REPORT_FILE).display()
        )))?;
        let report: ShardReport =
            serde_json::from_slice(&text).map_err(|e| damaged(format!("{REPORT_FILE}: {e}")))?;
        Ok(Self {
            spec: shard.spec,
            report,
            steps: dir.join(STEPS_FILE),
            episodes: dir.join(EPISODES_FILE),
        })
    }
}
