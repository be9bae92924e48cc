use faceoff_types::{EpisodeOutcome, SlotTiming};
use serde::{Deserialize, Serialize};

/// What one shard yields, beside its recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardReport {
    /// What happened in each episode, in order.
    pub outcomes: Vec<EpisodeOutcome>,
    /// The end of the agent's standard error, with its faults.
    pub log: String,
    /// More than the allowed faults: the remaining episodes were not played.
    pub stopped_by_faults: bool,
    /// How evenly the slot kept time meanwhile.
    pub timing: SlotTiming,
}
