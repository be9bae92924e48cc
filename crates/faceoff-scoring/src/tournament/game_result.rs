//! The result of a game: the winner and the reason, or why it is a draw.

use super::side::Side;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Winner of a game and the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GameResult {
    /// One side won.
    Won {
        /// The winning side.
        winner: Side,
        /// The rule that decided the game.
        reason: WinReason,
    },
    /// The game has no winner.
    Drawn(DrawReason),
}

/// Why a side won.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WinReason {
    /// Neither side was non-deployable, and the winner had the higher final score.
    Score,
    /// The other side was non-deployable.
    Tier {
        /// Whether the winner also had the higher final score before forfeits.
        had_higher_score: bool,
    },
    /// The other side forfeited.
    Forfeit {
        /// The limit that the other side exceeded.
        cause: ForfeitKind,
        /// Whether the winner also had the higher final score before forfeits.
        had_higher_score: bool,
    },
}

/// Why a game is a draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum DrawReason {
    /// Neither side was non-deployable, and the final scores were equal.
    EqualScore,
    /// Both sides were non-deployable.
    BothNonDeployable,
    /// Both sides forfeited.
    BothForfeit,
}

/// The limit that a side exceeded, so that it forfeited the game.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema), schema(as = Forfeit))]
#[serde(rename_all = "snake_case")]
pub enum ForfeitKind {
    /// Too many faults.
    Faults,
    /// Too much time for the whole game.
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

    /// Whether the winner had the higher final score before forfeits; `None` for a draw.
    #[must_use]
    pub const fn winner_led(self) -> Option<bool> {
        match self {
            Self::Won { reason, .. } => Some(match reason {
                WinReason::Score => true,
                WinReason::Tier { had_higher_score }
                | WinReason::Forfeit {
                    had_higher_score, ..
                } => had_higher_score,
            }),
            Self::Drawn(_) => None,
        }
    }
}

/// The reason in words, for tables.
impl fmt::Display for GameResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = match self {
            Self::Drawn(DrawReason::EqualScore) => return f.pad("equal scores"),
            Self::Drawn(DrawReason::BothNonDeployable) => return f.pad("both are non-deployable"),
            Self::Drawn(DrawReason::BothForfeit) => return f.pad("both forfeited"),
            Self::Won { reason, .. } => reason,
        };
        let (text, had_higher_score) = match reason {
            WinReason::Score => return f.pad("higher score"),
            WinReason::Tier { had_higher_score } => {
                ("the other side is non-deployable", had_higher_score)
            }
            WinReason::Forfeit {
                cause: ForfeitKind::Faults,
                had_higher_score,
            } => (
                "the other side forfeited: too many faults",
                had_higher_score,
            ),
            WinReason::Forfeit {
                cause: ForfeitKind::Time,
                had_higher_score,
            } => ("the other side forfeited: out of time", had_higher_score),
        };
        if *had_higher_score {
            f.pad(text)
        } else {
            f.pad(&format!("{text}; the winner did not lead"))
        }
    }
}

/// The JSON fields of a game with the reason of its result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ResultReason {
    /// Why the winner won; absent for a draw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    won_by: Option<WinKind>,
    /// Whether the winner also had the higher final score before forfeits; absent for a draw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    winner_led: Option<bool>,
    /// Why the game is a draw; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drawn_by: Option<DrawReason>,
}

/// [`WinReason`] without its details.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
enum WinKind {
    /// Neither side was non-deployable, and the winner had the higher final score.
    Score,
    /// The other side was non-deployable.
    Tier,
    /// The other side forfeited.
    Forfeit,
}

impl From<GameResult> for ResultReason {
    fn from(result: GameResult) -> Self {
        let (won_by, drawn_by) = match result {
            GameResult::Drawn(reason) => (None, Some(reason)),
            GameResult::Won { reason, .. } => {
                let kind = match reason {
                    WinReason::Score => WinKind::Score,
                    WinReason::Tier { .. } => WinKind::Tier,
                    WinReason::Forfeit { .. } => WinKind::Forfeit,
                };
                (Some(kind), None)
            }
        };
        Self {
            won_by,
            winner_led: result.winner_led(),
            drawn_by,
        }
    }
}
