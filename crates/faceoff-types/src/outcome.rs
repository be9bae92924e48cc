//! The outcome of an episode: how it ended, and what its score is computed from.

use crate::{AgentFault, ComputationTime, Task, Violations};
use serde::{Deserialize, Serialize};

/// Why an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub enum EpisodeEnd {
    /// All control steps were played.
    Horizon,
    /// The puck left the table, in a goal or elsewhere.
    LeftTable,
    /// `hit`, `defend`: the puck moved back across the middle line. `prepare`: it crossed the line.
    CrossedMiddle,
    /// `defend`: the puck became slow enough.
    Stopped,
    /// `prepare`: the puck reached the table's long axis.
    ReachedAxis,
    /// The agent violated the protocol or a limit.
    AgentFault,
}

impl EpisodeEnd {
    /// The name used in files and tables.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Horizon => "horizon",
            Self::LeftTable => "left_table",
            Self::CrossedMiddle => "crossed_middle",
            Self::Stopped => "stopped",
            Self::ReachedAxis => "reached_axis",
            Self::AgentFault => "agent_fault",
        }
    }
}

/// The outcome of an episode, with all that scoring needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeOutcome {
    pub task: Task,
    /// Index of the episode within the evaluation, from 0.
    pub episode: u32,
    /// Control steps played.
    pub steps: u32,
    pub end: EpisodeEnd,
    /// Success, tested on the last true state of the simulator; always false after an agent fault.
    pub success: bool,
    /// Constraints violated at least once.
    pub violations: Violations,
    pub computation_time: ComputationTime,
    /// The fault that ended the episode, if any.
    pub fault: Option<AgentFault>,
}
