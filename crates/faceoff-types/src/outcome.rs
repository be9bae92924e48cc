//! The outcome of an episode: how it ended, and what its score is computed from.

use crate::{AgentFault, ComputationTime, Task, Violations, short_name::short_name};
use serde::{Deserialize, Serialize};

short_name! {
    /// Why an episode ended. A competition has others beside the constants here.
    EpisodeEnd, "an end of an episode"
}

impl EpisodeEnd {
    /// All control steps were played.
    pub const HORIZON: Self = Self::new("horizon");
    /// The agent violated the protocol or a limit.
    pub const AGENT_FAULT: Self = Self::new("agent_fault");
}

/// The outcome of an episode, with all that scoring needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeOutcome {
    pub task: Task,
    /// Number of the episode among those of its task in the run, from 0.
    pub episode: u32,
    /// Control steps played.
    pub steps: u32,
    pub end: EpisodeEnd,
    /// Success, tested on the last true state of the simulator; always false after an agent fault.
    pub success: bool,
    /// The agent's limits that were violated at least once.
    pub violations: Violations,
    pub computation_time: ComputationTime,
    /// The fault that ended the episode, if any.
    pub fault: Option<AgentFault>,
}
