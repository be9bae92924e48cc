//! Limits that apply to a whole game between two agents.

use serde::{Deserialize, Serialize};

/// Limits of each side of a game, in addition to the time limits of single answers (docs/rules.md, "Tournament").
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct GameLimits {
    /// Longest time of an answer that still takes effect, in seconds.
    #[serde(rename = "in_time_s")]
    pub max_answer_s: f64,
    /// Faults allowed; one more forfeits the game.
    pub max_faults: u32,
    /// Total time for the answers, start-ups and resets of a side, in seconds; exceeding it forfeits the game.
    pub total_s: f64,
    /// Limit for a restart after a fault, in seconds; the first start has the limit of start-ups.
    pub restart_s: f64,
}

impl Default for GameLimits {
    fn default() -> Self {
        Self {
            max_answer_s: 0.02,
            max_faults: 10,
            total_s: 3600.0,
            restart_s: 10.0,
        }
    }
}
