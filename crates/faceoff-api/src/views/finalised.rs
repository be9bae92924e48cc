//! A result that is signed off.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The organiser has signed a stage's result off: nothing of the stage changes any more.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FinalisedView {
    /// When.
    pub at: Timestamp,
    /// Who.
    #[schema(example = "organiser")]
    pub by: String,
}
