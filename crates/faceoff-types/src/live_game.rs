//! Live view of a running game: its score, the positions of puck and robots, and its events. The view has no influence on
//! the result. A *rally* is a part of the game, which ends with a goal, a foul or the like.

use crate::{ForfeitCause, GameId, Side};
use serde::{Deserialize, Serialize};

/// An event of a running game. Viewers get all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LiveEvent {
    /// Control steps of the game before the event. A fault is reported at the end of its rally, so its step may be
    /// before that of the preceding event.
    pub step: u32,
    /// The event, by its `kind`.
    #[serde(flatten)]
    pub event: GameEvent,
}

/// The kinds of events of a game. In pairs, the first side comes first. Scores include points for the opponent's
/// fouls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GameEvent {
    /// Both sides are ready, or suspended after a fault, and the puck lies on one side.
    RallyBegun {
        /// Number of the rally, from 0.
        rally: u32,
        /// The side on which the puck lies, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        serves: Side,
    },
    /// The agent of a side was restarted after a fault.
    Restarted {
        /// 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        side: Side,
    },
    /// A goal ended the rally.
    Goal {
        /// The side that scored, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        by: Side,
        /// Score after the goal.
        score: [u32; 2],
    },
    /// A foul ended the rally.
    Foul {
        /// The side that committed the foul, 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        by: Side,
        /// Score after the foul.
        score: [u32; 2],
    },
    /// The puck lay in the middle, out of reach of both sides: the rally ended without a foul.
    Stuck,
    /// The puck left the table beside the goals: the rally ended.
    LeftTable,
    /// A side's commands drove the simulated world beyond what can be simulated: the rally ended.
    Diverged,
    /// A side violated the protocol or a limit. Its arm held still until the end of the rally. The event is sent when the rally is over.
    Fault {
        /// 1 or 2.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 2))]
        side: Side,
        /// Faults of the side so far, including this one.
        count: u32,
    },
    /// The game is over and has a result, which counts once it is stored.
    Ended {
        /// Final score; after a forfeit 10 : 0, or a larger lead.
        score: [u32; 2],
        /// The winning side, 1 or 2; null for a draw.
        #[cfg_attr(feature = "openapi", schema(value_type = Option<u32>, minimum = 1, maximum = 2))]
        winner: Option<Side>,
        /// For each side, the allowance that it exceeded if it forfeited.
        forfeits: [Option<ForfeitCause>; 2],
    },
    /// The attempt was stopped, or failed because of a platform fault, and has no result. A new attempt starts from the beginning.
    #[serde(rename = "broken_off")]
    Aborted,
}

impl GameEvent {
    /// Is the attempt over, with no more events to come?
    #[must_use]
    pub const fn is_last(&self) -> bool {
        matches!(self, Self::Ended { .. } | Self::Aborted)
    }
}

/// Positions after a control step, in the table frame, in metres and radians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LivePosition {
    /// Number of control steps played.
    pub step: u32,
    /// The puck's x, y and yaw.
    pub puck: [f64; 3],
    /// x and y of both mallets, the first side's first.
    pub mallets: [[f64; 2]; 2],
}

/// State of a running game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LiveGame {
    /// Id of the game.
    pub game: GameId,
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// Control steps of the whole game.
    pub steps: u32,
    /// Goals, and points for the opponent's fouls, the first side's first.
    pub score: [u32; 2],
    /// Fouls of each side, the first side's first.
    pub fouls: [u32; 2],
    /// The latest position; null before the first.
    pub position: Option<LivePosition>,
    /// Is the attempt over, with no more events to come?
    pub is_over: bool,
}
