//! Where something stands in the queue.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Where something that waits, or is under way, stands among all of its sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct QueueView {
    /// From 1: the how manieth to be over, if nothing is added; smoke runs and evaluations each for themselves.
    pub place: u32,
    /// Of how many that are not over.
    pub of: u32,
    /// When it will be over, by what such work took in the last seven days; null while the queue is paused, and
    /// where something that comes before it was never measured.
    pub expected_at: Option<Timestamp>,
}
