//! Positions of evaluations and validation runs in the queue of jobs.

use faceoff_types::deprecated_names;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Position of a pending or running evaluation or validation run in the queue. Evaluations and validation runs are
/// counted separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct QueueView {
    /// Position in the expected order of completion, from 1, if nothing is added.
    pub position: u32,
    /// Number of evaluations, or of validation runs, that have not ended.
    pub total: u32,
    /// Expected time of completion, from durations of the last seven days; null while the queue is paused, and if there
    /// are no measurements for an earlier position.
    pub expected_at: Option<Timestamp>,
}
deprecated_names!(QueueView { place => position, of => total });
