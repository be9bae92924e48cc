//! The tasks of the qualifying stage, each of which an agent plays in many episodes.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// The length of a control step, s (RULES, "Stages").
pub const CONTROL_STEP_S: f64 = 0.02;

/// Maximum number of control steps of a qualifying episode.
pub const EPISODE_STEPS: u32 = 500;

/// Maximum number of episodes per task in a run: a hundred times the qualifying stage, where the success
/// rate is known to ±0.3 %. Scoring holds all outcomes of a run in memory, some 300 bytes each.
pub const MAX_EPISODES_PER_TASK: u32 = 100_000;

/// A task of the qualifying stage (paper §2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Score a goal against an opponent that moves in a fixed pattern.
    Hit,
    /// Stop an incoming puck on the agent's own side.
    Defend,
    /// Move a puck from the border to a good hitting position.
    Prepare,
}

impl Task {
    /// All tasks, in the order of boards.
    pub const ALL: [Self; 3] = [Self::Hit, Self::Defend, Self::Prepare];

    /// The name used in files, in the protocol and on the command line.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::Defend => "defend",
            Self::Prepare => "prepare",
        }
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// Text that is not the name of a task.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown task {0:?}: expected hit, defend or prepare")]
pub struct ParseTaskError(pub String);

impl FromStr for Task {
    type Err = ParseTaskError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|task| task.as_str() == s)
            .ok_or_else(|| ParseTaskError(s.to_owned()))
    }
}
