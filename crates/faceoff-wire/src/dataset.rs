//! Files of a dataset: what an evaluation leaves behind beside its Parquet tables.
//!
//! A dataset is a zip archive with `manifest.json`, `results.json`, `violations.json`,
//! `calibration.json`, `episodes.parquet`, `steps.parquet` and `agent.log`. The layout is versioned by
//! [`DATASET_SCHEMA`]; `docs/dataset.md` describes every column.

use faceoff_types::{Profile, Seed, SlotTiming, Task, Variation};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name and version of the layout described here. Another meaning of a column is another version.
pub const DATASET_SCHEMA: &str = "faceoff-dataset/4";

/// `manifest.json`: what the dataset is and what its files must hash to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DatasetManifest {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// The ruleset's name.
    pub ruleset: String,
    /// The simulator that made the states; only the same one can make them again.
    pub simulator: SimulatorId,
    /// The perturbation profile.
    pub profile: Profile,
    /// What it was played and scored by otherwise than the ruleset has it.
    #[serde(flatten)]
    pub variation: Variation,
    /// The evaluation's seed.
    pub seed: Seed,
    /// The seed of the season's model mismatch.
    pub mismatch_seed: Seed,
    /// The agent's name.
    pub agent: String,
    /// The tasks and how many episodes of each.
    pub episodes: BTreeMap<Task, u32>,
    /// Every other file of the archive.
    pub files: BTreeMap<String, FileDigest>,
}

/// Which simulator made a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SimulatorId {
    /// The program's version.
    pub version: String,
    /// BLAKE3, 64 hexadecimal digits, of what the simulator makes of a few fixed episodes: two
    /// simulators that differ in one bit of them have different fingerprints, whatever their versions
    /// say.
    pub fingerprint: String,
}

/// Size and hash of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileDigest {
    /// Length in bytes.
    pub bytes: u64,
    /// 64 hexadecimal digits.
    pub blake3: String,
}

/// `violations.json`: where each constraint was broken.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ViolationsFile {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// Per task, in order of the episodes.
    pub tasks: BTreeMap<Task, TaskViolations>,
}

/// The violations of one task, per constraint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TaskViolations {
    /// End-effector position, metres beyond the bound.
    pub ee: Vec<ConstraintViolation>,
    /// Height of elbow and wrist, metres beyond the bound.
    pub link: Vec<ConstraintViolation>,
    /// Joint position, rad beyond 95 % of the limit.
    pub joint_pos: Vec<ConstraintViolation>,
    /// Joint velocity, rad/s beyond 95 % of the limit.
    pub joint_vel: Vec<ConstraintViolation>,
    /// Computation time: episodes with penalty points for it.
    pub computation_time: Vec<SlowEpisode>,
}

/// A constraint broken in one episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ConstraintViolation {
    /// Index within the evaluation, from 0.
    pub episode: u32,
    /// The first control step at which it was broken.
    pub first_step: u32,
    /// Control steps at which it was broken.
    pub steps: u32,
    /// The largest value of the constraint; violated when above 0.
    pub max: f64,
}

/// An episode with penalty points for computation time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlowEpisode {
    /// Index within the evaluation, from 0.
    pub episode: u32,
    /// Over the answered steps, in seconds.
    pub mean_s: f64,
    /// The slowest answer, in seconds.
    pub max_s: f64,
    /// What they cost: 0.5, 1 or 2.
    pub points: f64,
    /// Since layout 4, if a step was answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slowest: Option<SlowStep>,
}

/// The slowest answer of an episode: what it took, and whose time that was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SlowStep {
    /// The control step, from 0; the first of those that took equally long.
    pub step: u32,
    /// From the first attempt to write the question to the last byte of the answer, in seconds.
    pub wall_s: f64,
    /// What the host took of it, in seconds; the rest counts.
    pub host_s: f64,
    /// CPU time of the agent's process tree meanwhile, in seconds, where the host told.
    pub cpu_s: Option<f64>,
}

/// `calibration.json`: how evenly the slots kept time, measured by the platform itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CalibrationFile {
    /// [`DATASET_SCHEMA`].
    pub schema: String,
    /// In order of the tasks and episodes.
    pub shards: Vec<ShardCalibration>,
}

impl CalibrationFile {
    /// The worst of all slots, value by value; `None` without any.
    #[must_use]
    pub fn worst(&self) -> Option<SlotTiming> {
        let timings = self.shards.iter().map(|shard| shard.timing);
        timings.reduce(SlotTiming::worse)
    }
}

/// The measurements of the slot that played a range of episodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShardCalibration {
    /// The task.
    pub task: Task,
    /// Index within the evaluation, from 0.
    pub first_episode: u32,
    /// One past the last episode.
    pub end_episode: u32,
    /// What was measured.
    #[serde(flatten)]
    pub timing: SlotTiming,
}
