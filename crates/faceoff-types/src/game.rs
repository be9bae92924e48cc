//! What happened in a game: all that scoring needs.

use crate::{AgentFault, ComputationTime, Side, Violations};
use serde::{Deserialize, Serialize};
use std::fmt;

/// What happened in a game. Pairs are the first side's first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameOutcome {
    pub steps: u32,
    pub rallies: u32,
    pub end: GameEnd,
    /// What each side did.
    pub sides: [SideOutcome; 2],
}

/// How a game ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GameEnd {
    /// All control steps were played.
    Played,
    /// A side used up its faults or its time.
    Forfeit {
        by: Side,
        /// What it used up.
        cause: ForfeitCause,
    },
    /// Both did, in the same control step or while they got ready for the same rally.
    BothForfeit {
        /// What each used up.
        causes: [ForfeitCause; 2],
    },
}

impl GameEnd {
    #[must_use]
    pub const fn as_str(&self) -> &'static str {
        match self {
            Self::Played => "played",
            Self::Forfeit { .. } => "forfeit",
            Self::BothForfeit { .. } => "both_forfeit",
        }
    }

    /// What each side used up, if it forfeited.
    #[must_use]
    pub const fn forfeits(&self) -> [Option<ForfeitCause>; 2] {
        match self {
            Self::Played => [None, None],
            Self::Forfeit {
                by: Side::First,
                cause,
            } => [Some(*cause), None],
            Self::Forfeit {
                by: Side::Second,
                cause,
            } => [None, Some(*cause)],
            Self::BothForfeit { causes: [a, b] } => [Some(*a), Some(*b)],
        }
    }
}

/// What a side used up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ForfeitCause {
    /// Its faults.
    Faults {
        /// How many it had.
        count: u32,
        /// How many do not forfeit.
        allowed: u32,
    },
    /// Its time for answers, start-ups and resets.
    Time {
        /// What it used, in seconds.
        used_s: f64,
        /// What is allowed, in seconds.
        allowed_s: f64,
    },
}

impl fmt::Display for ForfeitCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Faults { count, allowed } => write!(f, "{count} faults, {allowed} are allowed"),
            Self::Time { used_s, allowed_s } => write!(
                f,
                "answers, start-ups and resets took {used_s:.1} s in all, {allowed_s:.1} s are allowed"
            ),
        }
    }
}

/// What one side of a game did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SideOutcome {
    /// Goals scored, without points for the opponent's fouls.
    pub goals: u32,
    pub fouls: u32,
    /// Windows of 500 control steps, in order; the last may be shorter.
    pub windows: Vec<GameWindow>,
    /// Control steps that were answered, in time or not.
    pub answers: u32,
    /// Answers that came too late to take effect.
    pub late_answers: u32,
    /// Its faults, in order.
    pub faults: Vec<GameFault>,
    /// What its answers, start-ups and resets took in all, less what the host took, in seconds.
    pub time_used_s: f64,
}

/// What a side did in one window: the game's equivalent of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct GameWindow {
    pub steps: u32,
    /// Constraints broken at least once.
    pub violations: Violations,
    /// Of its answers, those that came too late included.
    pub computation_time: ComputationTime,
    pub faults: u32,
}

/// A fault in a game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameFault {
    /// Control steps that the game had played before.
    pub game_step: u32,
    /// What it was; its episode is the rally's number, its step is the rally's.
    #[serde(flatten)]
    pub fault: AgentFault,
}

impl fmt::Display for GameFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "control step {} of the game: {}",
            self.game_step, self.fault
        )
    }
}
