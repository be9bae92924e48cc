//! What the files are called.

/// The dataset's archive in the folder that `faceoff eval` writes.
pub const ARCHIVE_FILE: &str = "dataset.zip";
/// A row per answered control step.
pub(crate) const STEPS_FILE: &str = "steps.parquet";
/// A row per episode.
pub(crate) const EPISODES_FILE: &str = "episodes.parquet";
/// Where constraints were broken.
pub(crate) const VIOLATIONS_FILE: &str = "violations.json";
pub(crate) const RESULTS_FILE: &str = "results.json";
/// How evenly the slots kept time.
pub(crate) const CALIBRATION_FILE: &str = "calibration.json";
/// What a dataset is, and the hashes of its other files.
pub(crate) const MANIFEST_FILE: &str = "manifest.json";
/// What replays are drawn from, in a shard's folder; beside the dataset, not in it.
pub const CLIPS_FILE: &str = "clips";
/// The end of the agent's standard error.
pub(crate) const LOG_FILE: &str = "agent.log";
