//! The ways in which a team leaves a tournament.

use serde::{Deserialize, Serialize};

/// How a team left a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum DepartureKind {
    /// The team withdrew; it keeps its rank.
    Withdrawn,
    /// The organisers disqualified the team; it ranks below all others.
    Disqualified,
}
