//! File names of datasets and of shards (recordings of a part of an evaluation's episodes), and the removal of files that
//! may be missing.

use std::io::{self, ErrorKind};

/// The dataset's archive in the folder that `faceoff eval` writes.
pub const ARCHIVE_FILE: &str = "dataset.zip";
/// A row per answered control step.
pub(crate) const STEPS_FILE: &str = "steps.parquet";
/// A row per episode.
pub(crate) const EPISODES_FILE: &str = "episodes.parquet";
/// Violations of constraints, and slow answers.
pub(crate) const VIOLATIONS_FILE: &str = "violations.json";
pub(crate) const RESULTS_FILE: &str = "results.json";
/// Timing measurements of the slots, the places on the workers where the agents ran.
pub(crate) const CALIBRATION_FILE: &str = "calibration.json";
/// Description of the dataset, and the hashes of its other files.
pub(crate) const MANIFEST_FILE: &str = "manifest.json";
/// Pack of clips for replays, in a shard's folder; stored beside the dataset, not in it.
pub const CLIPS_FILE: &str = "clips";
/// The beginning and the end of the agent's standard error.
pub(crate) const LOG_FILE: &str = "agent.log";
/// The report of a shard, in its folder.
pub(crate) const REPORT_FILE: &str = "report.json";
/// Description of a shard and the hashes of its files. Written last: a folder with this file is complete.
pub(crate) const SHARD_FILE: &str = "shard.json";

/// The largest accepted file of a recording with this name, in bytes: far more than any shard or game writes.
#[must_use]
pub fn max_file_bytes(name: &str) -> u64 {
    match name {
        SHARD_FILE => 1 << 20,
        // Read into memory.
        REPORT_FILE | LOG_FILE => 64 << 20,
        _ => 4 << 30,
    }
}

/// The largest accepted file of a dataset or a game that is read into memory as a whole, in bytes. Archives of strangers can
/// hold gigabytes in a few kilobytes.
pub(crate) fn max_json_bytes(name: &str) -> u64 {
    match name {
        MANIFEST_FILE => 1 << 20,
        // These grow with the number of episodes.
        VIOLATIONS_FILE | CALIBRATION_FILE => 128 << 20,
        _ => 16 << 20,
    }
}

/// The result of a removal, which has also succeeded if there was nothing to remove.
///
/// # Errors
/// Any other error of the removal.
pub fn allow_missing(removed: io::Result<()>) -> io::Result<()> {
    match removed {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
