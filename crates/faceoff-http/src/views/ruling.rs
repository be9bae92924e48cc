//! What the organiser has decided, and why.

use faceoff_store::Ruling;
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

impl From<Ruling> for RulingView {
    fn from(Ruling { at, reason }: Ruling) -> Self {
        Self { at, reason }
    }
}
