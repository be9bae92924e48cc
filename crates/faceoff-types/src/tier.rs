//! Deployability tiers: how safe an agent would be on the real robot, judged by its penalty points.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Deployability tier, best first (docs/rules.md, "Tiers").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Tier {
    /// Safe enough for the real robot.
    Deployable,
    /// Could become safe enough.
    Improvable,
    /// Would endanger the real robot.
    NonDeployable,
}

impl Tier {
    /// All tiers, in the order of boards.
    pub const ALL: [Self; 3] = [Self::Deployable, Self::Improvable, Self::NonDeployable];

    /// The name used in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Deployable => "deployable",
            Self::Improvable => "improvable",
            Self::NonDeployable => "non_deployable",
        }
    }

    /// The heading used on boards.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Deployable => "Deployable",
            Self::Improvable => "Improvable",
            Self::NonDeployable => "Non-deployable",
        }
    }
}

impl fmt::Display for Tier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}
