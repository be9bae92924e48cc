//! The sign-off of a stage's result, with which an organiser declares it final.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The sign-off of a stage's result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct SignOffView {
    /// When it was signed off.
    pub at: Timestamp,
    /// Who signed it off, as the event log writes actors: `person:ID` or `organiser`.
    #[schema(example = "organiser")]
    pub by: String,
}
