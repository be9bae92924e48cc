//! A game as it is watched while it is played. What is told here decides nothing.

use crate::{ForfeitCause, GameId, Side};
use serde::{Deserialize, Serialize};

/// Something that happened in a game under way. None is ever left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LiveHappening {
    /// Control steps that the game had played before. A fault is told when its rally is over, so that its step may be
    /// an earlier one than that of what was told before.
    pub step: u32,
    /// What.
    #[serde(flatten)]
    pub what: GameHappening,
}

/// What can happen in a game. Pairs are the first side's first; scores are final ones so far, points for the
/// opponent's fouls included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GameHappening {
    /// Both sides are ready, or held by a fault, and the puck lies on a side.
    RallyBegun {
        /// From 0.
        rally: u32,
        /// Whose side, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        serves: Side,
    },
    /// A side's agent was started anew after a fault.
    Restarted {
        /// 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        side: Side,
    },
    /// A goal ended the rally.
    Goal {
        /// Who scored, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        by: Side,
        /// With it.
        score: [u32; 2],
    },
    /// A foul ended the rally.
    Foul {
        /// Who fouled, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        by: Side,
        /// With it.
        score: [u32; 2],
    },
    /// The puck lay in the middle, where nobody reaches it: the rally ended without a foul.
    Stuck,
    /// The puck left the table beside the goals: the rally ended.
    LeftTable,
    /// A side's commands drove the simulated world beyond what can be simulated: the rally ended.
    Diverged,
    /// A side broke the protocol or a limit: its arm held to the end of the rally that is over now.
    Fault {
        /// 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        side: Side,
        /// How many it has had with this one.
        count: u32,
    },
    /// The game is over and has a result, which counts once it is stored.
    Ended {
        /// 10 : 0 after a forfeit.
        score: [u32; 2],
        /// 1 or 2; none: a draw.
        #[cfg_attr(feature = "openapi", schema(value_type = Option<u32>, minimum = 1, maximum = 2))]
        winner: Option<Side>,
        /// What each side used up, if it forfeited.
        forfeits: [Option<ForfeitCause>; 2],
    },
    /// It was stopped, or broken by us: there is no result of it. If it is played again, it begins anew.
    BrokenOff,
}

impl GameHappening {
    /// Is nothing told of this attempt any more?
    #[must_use]
    pub const fn is_last(&self) -> bool {
        matches!(self, Self::Ended { .. } | Self::BrokenOff)
    }
}

/// Where things were after a control step: table frame, metres and radians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LivePosition {
    /// Control steps that were played by then.
    pub step: u32,
    /// The puck's x, y and yaw.
    pub puck: [f64; 3],
    /// Both mallets' x and y, the first side's first.
    pub mallets: [[f64; 2]; 2],
}

/// How a game under way stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LiveGame {
    /// Which.
    pub game: GameId,
    /// Which attempt is told of, from 1.
    pub attempt: u32,
    /// Control steps of the whole game.
    pub steps: u32,
    /// Goals, and points for the opponent's fouls, the first side's first.
    pub score: [u32; 2],
    /// Fouls.
    pub fouls: [u32; 2],
    /// The newest that was told; none before the first.
    pub position: Option<LivePosition>,
    /// Is nothing told of this attempt any more?
    pub is_over: bool,
}
