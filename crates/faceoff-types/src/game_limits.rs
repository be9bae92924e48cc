use serde::{Deserialize, Serialize};

/// What each side of a game is held to beside the limits of single answers (RULES, "Tournament").
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct GameLimits {
    /// An answer that takes longer, in seconds, does not take effect.
    pub in_time_s: f64,
    /// More faults than this forfeit the game.
    pub max_faults: u32,
    /// All answers, start-ups and resets of a side in all, in seconds; what takes longer forfeits the game.
    pub total_s: f64,
    /// To start again after a fault, in seconds; the first start has the start-up's limit.
    pub restart_s: f64,
}

impl Default for GameLimits {
    fn default() -> Self {
        Self {
            in_time_s: 0.02,
            max_faults: 10,
            total_s: 3600.0,
            restart_s: 10.0,
        }
    }
}
