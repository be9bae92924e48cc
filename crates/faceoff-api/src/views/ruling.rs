//! What the organiser has decided, and why.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A decision against a result or a team.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RulingView {
    /// When.
    pub at: Timestamp,
    /// The organiser's words.
    pub reason: String,
}
