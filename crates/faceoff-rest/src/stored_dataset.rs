//! Where the dataset of an evaluation, which is its recording, is stored; for routes that send it or read it.

use faceoff_types::TeamId;
use jiff::civil::Date;

/// The stored dataset of an evaluation.
#[derive(Debug)]
pub(super) struct StoredDataset {
    pub(super) team: TeamId,
    pub(super) day: Date,
    /// Artifact key of the file.
    pub(super) dataset: String,
    /// BLAKE3 hash of the file; `None` for datasets of older versions.
    pub(super) blake3: Option<String>,
}
