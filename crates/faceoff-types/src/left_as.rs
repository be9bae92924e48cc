use serde::{Deserialize, Serialize};

/// How a team left a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum LeftAs {
    /// By its own wish. It keeps its place among the others.
    Withdrawn,
    /// By the organiser's decision. It stands below all others.
    Disqualified,
}
