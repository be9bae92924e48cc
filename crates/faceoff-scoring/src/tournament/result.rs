use super::side::Side;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How a game ended, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GameResult {
    /// One side won.
    Won {
        /// Which.
        winner: Side,
        /// Why.
        by: WonBy,
    },
    /// Nobody won.
    Drawn(DrawnBy),
}

/// Why a side won. `led` says whether it also had the higher final score as played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WonBy {
    /// Both sides were safe enough, and it had the higher final score.
    Score,
    /// The other side was non-deployable.
    Tier {
        /// Whether the winner led.
        led: bool,
    },
    /// The other side forfeited.
    Forfeit {
        /// What the other side used up.
        cause: Forfeit,
        /// Whether the winner led.
        led: bool,
    },
}

/// Why nobody won.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum DrawnBy {
    /// Both sides were safe enough, and their final scores equal.
    EqualScore,
    /// Neither side was safe enough to win.
    BothNonDeployable,
    /// Both sides forfeited.
    BothForfeit,
}

/// What a side used up that forfeits a game.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Forfeit {
    /// Its faults.
    Faults,
    /// Its time for the whole game.
    Time,
}

impl GameResult {
    /// The winner; `None` is a draw.
    #[must_use]
    pub const fn winner(self) -> Option<Side> {
        match self {
            Self::Won { winner, .. } => Some(winner),
            Self::Drawn(_) => None,
        }
    }

    /// Whether the winner had the higher final score as played; `None` of a draw.
    #[must_use]
    pub const fn winner_led(self) -> Option<bool> {
        match self {
            Self::Won { by, .. } => Some(match by {
                WonBy::Score => true,
                WonBy::Tier { led } | WonBy::Forfeit { led, .. } => led,
            }),
            Self::Drawn(_) => None,
        }
    }
}

/// In words, as tables have it beside the winner.
impl fmt::Display for GameResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let by = match self {
            Self::Drawn(DrawnBy::EqualScore) => return f.pad("equal scores"),
            Self::Drawn(DrawnBy::BothNonDeployable) => return f.pad("both are non-deployable"),
            Self::Drawn(DrawnBy::BothForfeit) => return f.pad("both forfeited"),
            Self::Won { by, .. } => by,
        };
        let (why, led) = match by {
            WonBy::Score => return f.pad("higher score"),
            WonBy::Tier { led } => ("the other side is non-deployable", led),
            WonBy::Forfeit {
                cause: Forfeit::Faults,
                led,
            } => ("the other side forfeited by its faults", led),
            WonBy::Forfeit {
                cause: Forfeit::Time,
                led,
            } => ("the other side forfeited by its time", led),
        };
        if *led {
            f.pad(why)
        } else {
            f.pad(&format!("{why}; the winner did not lead"))
        }
    }
}

/// The fields of a game's JSON that say why.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Why {
    /// Why a side won.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    won_by: Option<WonByWord>,
    /// Whether the winner also had the higher final score as played.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    winner_led: Option<bool>,
    /// Why nobody won.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drawn_by: Option<DrawnBy>,
}

/// [`WonBy`] in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
enum WonByWord {
    /// Both sides were safe enough, and it had the higher final score.
    Score,
    /// The other side was non-deployable.
    Tier,
    /// The other side forfeited.
    Forfeit,
}

impl From<GameResult> for Why {
    fn from(result: GameResult) -> Self {
        let (won_by, drawn_by) = match result {
            GameResult::Drawn(by) => (None, Some(by)),
            GameResult::Won { by, .. } => {
                let by = match by {
                    WonBy::Score => WonByWord::Score,
                    WonBy::Tier { .. } => WonByWord::Tier,
                    WonBy::Forfeit { .. } => WonByWord::Forfeit,
                };
                (Some(by), None)
            }
        };
        Self {
            won_by,
            winner_led: result.winner_led(),
            drawn_by,
        }
    }
}
