//! The outcome of a game, with all that scoring needs. A game is a series of *rallies*, each of which ends with a goal, a
//! foul or the like. For penalty points it is divided into *windows* of 500 control steps.

use crate::{AgentFault, ComputationTime, Side, Violations};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Control steps of a window, the equivalent of an episode in games: each violation counts at most once per window
/// (paper on the 2023 Robot Air Hockey Challenge, §2.2).
pub const WINDOW_STEPS: u32 = 500;

/// Windows (of 500 control steps) of a game: 45,000 control steps, 15 minutes (paper §2.2).
pub const GAME_WINDOWS: u32 = 90;

/// Number of fouls of a robot that give its opponent one point (reference implementation).
pub const FOULS_PER_POINT: u32 = 3;

/// What a forfeited game counts for the side that did not forfeit, as score and as goals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ForfeitScore {
    /// 10 : 0 in any case. The rule of tournaments that earlier versions opened.
    #[default]
    Ten,
    /// 10 : 0, or the score at the forfeit if that side led by more than ten. So a side that is far behind cannot reduce its defeat by a
    /// forfeit.
    TenOrLead,
}

impl ForfeitScore {
    /// Is it the rule of earlier versions, which is left out of JSON?
    #[must_use]
    pub const fn is_legacy(&self) -> bool {
        matches!(self, Self::Ten)
    }
}

/// The outcome of a game. In pairs, the first side comes first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameOutcome {
    /// Control steps played.
    pub steps: u32,
    /// Rallies started.
    pub rallies: u32,
    pub end: GameEnd,
    pub sides: [SideOutcome; 2],
}

/// How a game ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GameEnd {
    /// All control steps were played.
    Played,
    /// One side exceeded its allowed faults or time.
    Forfeit {
        /// The side that forfeited.
        by: Side,
        /// What it exceeded.
        cause: ForfeitCause,
    },
    /// Both sides exceeded theirs, in the same control step or while getting ready for the same rally.
    BothForfeit {
        /// What each side exceeded.
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

    /// What each side exceeded, if it forfeited.
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
            Self::BothForfeit {
                causes: [first, second],
            } => [Some(*first), Some(*second)],
        }
    }
}

/// The allowance that a side exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ForfeitCause {
    /// The number of faults.
    Faults {
        /// Faults of the side.
        count: u32,
        /// The largest number that does not forfeit the game.
        allowed: u32,
    },
    /// The total time for answers, start-ups and resets.
    Time {
        /// Time used, in seconds.
        used_s: f64,
        /// Time allowed, in seconds.
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

/// The outcome of one side of a game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SideOutcome {
    /// Goals scored, without points for the opponent's fouls.
    pub goals: u32,
    pub fouls: u32,
    /// The side's windows of 500 control steps, in order; the last may be shorter.
    pub windows: Vec<GameWindow>,
    /// Control steps that were answered, in time or not.
    pub answers: u32,
    /// Answers that came too late to take effect.
    pub late_answers: u32,
    /// In order of occurrence.
    pub faults: Vec<GameFault>,
    /// Total time of its answers, start-ups and resets, in seconds, without host interference.
    pub time_used_s: f64,
}

/// One window of one side: the game's equivalent of an episode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GameWindow {
    /// Control steps of the window.
    pub steps: u32,
    /// The robot's limits that were violated at least once in the window.
    pub violations: Violations,
    /// Includes answers that came too late to take effect.
    pub computation_time: ComputationTime,
    pub faults: u32,
}

/// A fault in a game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GameFault {
    /// Control steps of the game before the fault.
    pub game_step: u32,
    /// Its `episode` is the number of the rally, its `step` the step within the rally.
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
