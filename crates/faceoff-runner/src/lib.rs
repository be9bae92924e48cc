//! Runner. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_types::*;
use std::{ops::Range, path::{Path, PathBuf}};
use faceoff_sandbox::{Isolation, Limits, Runtime, SandboxError};
use serde::{Serialize, Deserialize};
use std::collections::BTreeMap;

/// Unpacks a .tar.gz/.tar.zst/.zip into `dir` safely, finds agent.toml; used at upload time (by worker's smoke run), by eval.
/// (http only stores the bytes and their hash.)
pub mod bundle {
    use super::*;
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct BundleLimits { pub packed_bytes: u64, pub unpacked_bytes: u64, pub files: u64 }
    impl Default for BundleLimits { fn default() -> Self { unimplemented!() } }
    /// What is wrong with the team's archive; the text is shown to the team.
    #[derive(Debug, thiserror::Error)]
    pub enum BundleError {
        /// team's fault: message names the entry
        #[error("{0}")] Invalid(String),
        /// ours
        #[error("{what}: {source}")] Io { what: String, source: std::io::Error },
    }
    /// An unpacked bundle: the folder that holds agent.toml and the parsed manifest.
    #[derive(Debug, Clone)]
    pub struct Bundle { pub dir: PathBuf, pub manifest: faceoff_wire::Manifest }
    pub fn unpack(archive: &Path, into: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> { unimplemented!() }
    /// A developer's own folder, or an archive (unpacked into `scratch`).
    pub fn open(path: &Path, scratch: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> { unimplemented!() }
}

/// Time limits of PROTOCOL; fields *_s as f64 or Duration via serde seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimeLimits { pub startup_s: f64, pub reset_s: f64, pub step_s: f64, pub bye_s: f64 }
impl Default for TimeLimits { fn default() -> Self { unimplemented!() } }

/// How agents are run on this machine (one struct from the configuration).
#[derive(Debug, Clone)]
pub struct AgentEnvironment {
    pub limits: Limits, pub time: TimeLimits, pub isolation: Isolation,
    pub runtimes: BTreeMap<String, Runtime>,
    pub agent_cpus: Vec<usize>,
}

/// What to simulate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardSpec {
    pub task: Task, pub episodes: Range<u32>, pub profile: Profile,
    /// evaluation seed
    pub seed: Seed,
    /// season mismatch seed
    pub mismatch_seed: Seed,
    /// more faults than this end the shard early as `AgentFailed`
    pub max_faults: u32,
}

/// What one shard yields. Its recording is the folder `out`: `steps.parquet`, `episodes.parquet`, `report.json` (this), `agent.log`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardReport {
    pub outcomes: Vec<EpisodeOutcome>,
    /// tail of stderr
    pub log: String,
    /// true when max_faults was exceeded: the remaining episodes were not played
    pub stopped_by_faults: bool,
}

/// Called between episodes.
pub trait Observer { fn episode_done(&mut self, outcome: &EpisodeOutcome); /** true = stop: the shard was cancelled */ fn cancelled(&self) -> bool; }

#[derive(Debug, thiserror::Error)]
pub enum PlatformFault {
    #[error(transparent)] Sandbox(#[from] SandboxError),
    #[error("{what}: {source}")] Io { what: String, source: std::io::Error },
    #[error("recording: {0}")] Recording(String),
    #[error("cancelled")] Cancelled,
}

pub fn run_shard(spec: &ShardSpec, bundle: &bundle::Bundle, env: &AgentEnvironment, out: &Path, observer: &mut dyn Observer) -> Result<ShardReport, PlatformFault> { unimplemented!() }

/// Smoke run: same sandbox and limits as the real run; one episode of at most 50 steps of each task. Ok(Err(fault)) = the agent's fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SmokeReport { pub fault: Option<AgentFault>, pub log: String }
pub fn smoke(bundle: &bundle::Bundle, env: &AgentEnvironment) -> Result<SmokeReport, PlatformFault> { unimplemented!() }

/// Joins shard recordings (in task, first-episode order) into one zip at `archive`: `steps.parquet`, `episodes.parquet`,
/// `results.json`, `manifest.json` (hashes), `agent.log`; and returns the score.
pub fn assemble(meta: &EvaluationMeta, shard_dirs: &[PathBuf], archive: &Path) -> Result<EvaluationResult, PlatformFault> { unimplemented!() }
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluationMeta { pub profile: Profile, pub seed: Seed, pub mismatch_seed: Seed, pub agent: String, pub ruleset: String }
