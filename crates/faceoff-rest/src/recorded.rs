use faceoff_types::TeamId;
use jiff::civil::Date;

/// The dataset of an evaluation, or of what a proposal has played.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) team: TeamId,
    pub(super) day: Date,
    /// Its name among the artifacts.
    pub(super) dataset: String,
    /// Of the file; unknown of those that older programs made.
    pub(super) blake3: Option<String>,
}
