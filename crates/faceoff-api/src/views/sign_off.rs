//! The sign-off of a stage's result.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An organiser has signed off the stage's result; the stage is final.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct SignOffView {
    /// When it was signed off.
    pub at: Timestamp,
    /// Who signed it off, as the event log writes actors.
    #[schema(example = "organiser")]
    pub by: String,
}
