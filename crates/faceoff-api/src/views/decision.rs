//! The record of an organiser's decision, with time and reason.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An organiser's decision about a result, a team or the queue.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = RulingView)]
pub struct DecisionView {
    /// When it was made.
    pub at: Timestamp,
    /// The organiser's reason.
    pub reason: String,
}
