//! JSON files of an evaluation's dataset. A *dataset* is the complete recording of an *evaluation*, in which one agent plays all
//! episodes of the tasks.
//!
//! A dataset is a zip archive with `manifest.json`, `results.json`, `violations.json`,
//! `calibration.json`, `episodes.parquet`, `steps.parquet` and `agent.log`. The layout is versioned by
//! [`DATASET_SCHEMA`]; `docs/dataset.md` describes every column.

use faceoff_types::{Profile, Seed, SlotTiming, Task, TaskMap, Variation, ViolationName};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name and version of this layout. A change in a column's meaning is a new version.
pub const DATASET_SCHEMA: &str = "faceoff-dataset/4";

/// `manifest.json`: a description of the dataset, with the hashes of its files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DatasetManifest {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// The ruleset's name.
    pub ruleset: String,
    /// The simulator that computed the states; only the same one reproduces them.
    pub simulator: SimulatorId,
    /// The perturbation profile: a named set of disturbances of the simulation.
    pub profile: Profile,
    /// Organisers' deviations from the ruleset, in perturbations and in scoring.
    #[serde(flatten)]
    pub variation: Variation,
    /// The evaluation's seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch: how the simulated robot deviates from the nominal one that agents know.
    pub mismatch_seed: Seed,
    /// The agent's name.
    pub agent: String,
    /// Number of episodes of each task.
    pub episodes: TaskMap<u32>,
    /// Size and hash of every other file of the archive, by name.
    pub files: BTreeMap<String, FileDigest>,
}

/// Identity of the simulator that made a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SimulatorId {
    /// Version of the program.
    pub version: String,
    /// BLAKE3 of the simulated states of a few fixed episodes, 64 hexadecimal digits. Two simulators with different
    /// states have different fingerprints, even if their versions are equal.
    pub fingerprint: String,
}

/// Size and hash of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileDigest {
    /// Length in bytes.
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// `violations.json`: the episodes in which each constraint was violated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ViolationsFile {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// Violations by task, in the order of the episodes.
    pub tasks: TaskMap<TaskViolations>,
}

/// The violations of one task.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TaskViolations {
    /// For each constraint (limit of the robot that the simulator checks), the episodes in which it was violated.
    #[serde(flatten)]
    pub constraints: IndexMap<ViolationName, Vec<ConstraintViolation>>,
    /// Computation time: the episodes with penalty points for it.
    pub computation_time: Vec<SlowEpisode>,
}

/// The violation of a constraint in one episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ConstraintViolation {
    /// Number of the episode among those of its task in the evaluation, from 0.
    pub episode: u32,
    /// The first control step with a violation.
    pub first_step: u32,
    /// Number of control steps with a violation.
    pub steps: u32,
    /// The largest excess over the bound, in the constraint's unit; above 0 the constraint is violated.
    pub max: f64,
}

/// An episode with penalty points for computation time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlowEpisode {
    /// Number of the episode among those of its task in the evaluation, from 0.
    pub episode: u32,
    /// Mean computation time over the answered steps, in seconds.
    pub mean_s: f64,
    /// Longest computation time, in seconds.
    pub max_s: f64,
    /// Penalty points: 0.5, 1 or 2.
    pub points: f64,
    /// The slowest answer, if a step was answered. Datasets before [`DATASET_SCHEMA`] 4 do not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slowest: Option<SlowStep>,
}

/// The slowest answer of an episode, with the parts of its time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlowStep {
    /// The control step, from 0; the first one if several took equally long.
    pub step: u32,
    /// Wall time from the first attempt to write the observation to the last byte of the answer, in seconds.
    pub wall_s: f64,
    /// Part of the wall time due to host interference (other load on the machine), in seconds; the rest is the computation time.
    pub host_s: f64,
    /// CPU time of the agent's process tree during the wall time, in seconds, if the host reports it.
    pub cpu_s: Option<f64>,
}

/// `calibration.json`: timing quality of the slots, measured by the platform. A *slot* is a place in a worker that runs one job at
/// a time; a *shard* is a range of episodes that one slot plays as one job.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CalibrationFile {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// One entry per shard, in the order of tasks and episodes.
    pub shards: Vec<ShardCalibration>,
}

impl CalibrationFile {
    /// The worst value of all slots for each field; `None` without shards.
    #[must_use]
    pub fn worst(&self) -> Option<SlotTiming> {
        let timings = self.shards.iter().map(|shard| shard.timing);
        timings.reduce(SlotTiming::worse)
    }
}

/// Timing quality of the slot that played a shard.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShardCalibration {
    /// The task.
    pub task: Task,
    /// Number of the shard's first episode among those of its task, from 0.
    pub first_episode: u32,
    /// One more than the number of the shard's last episode.
    pub end_episode: u32,
    /// The measurements.
    #[serde(flatten)]
    pub timing: SlotTiming,
}
