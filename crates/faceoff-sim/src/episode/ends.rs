//! How episodes end, beside [`EpisodeEnd::HORIZON`] and [`EpisodeEnd::AGENT_FAULT`].

use faceoff_types::EpisodeEnd;

/// The puck left the table, in a goal or elsewhere, or became too fast for the simulation.
pub const LEFT_TABLE: EpisodeEnd = EpisodeEnd::new("left_table");
/// `hit`: the puck is in the opponent's half and moves back, without a goal. `defend`: the agent sent it back across the middle
/// line. `prepare`: it crossed that line.
pub const CROSSED_MIDDLE: EpisodeEnd = EpisodeEnd::new("crossed_middle");
/// `defend`: the puck became slow enough.
pub const STOPPED: EpisodeEnd = EpisodeEnd::new("stopped");
/// `prepare`: the puck reached the table's long axis.
pub const REACHED_AXIS: EpisodeEnd = EpisodeEnd::new("reached_axis");

/// All ends of air hockey's episodes, with the two that all competitions have, in the order in which pages list them. The position of an
/// end is its code in Python (`ENDS`).
pub const ALL: [EpisodeEnd; 6] = [
    EpisodeEnd::HORIZON,
    LEFT_TABLE,
    CROSSED_MIDDLE,
    STOPPED,
    REACHED_AXIS,
    EpisodeEnd::AGENT_FAULT,
];
