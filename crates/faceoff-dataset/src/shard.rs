//! The report of a shard. A shard is a range of episodes of one task that one worker runs.

use faceoff_types::{EpisodeOutcome, SlotTiming};
use serde::{Deserialize, Serialize};

/// The results of one shard, beside its recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardReport {
    /// Outcome of each episode, in order.
    pub outcomes: Vec<EpisodeOutcome>,
    /// The beginning and the end of the agent's standard error, with its faults.
    pub log: String,
    /// Did the agent exceed the allowed number of faults, so that the remaining episodes were not run?
    pub stopped_by_faults: bool,
    /// Timing measurements of the slot, the place on the worker where the agent ran.
    pub timing: SlotTiming,
}
