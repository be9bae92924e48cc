use faceoff_types::{EpisodeOutcome, Profile, Seed, SlotTiming, Task};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What to simulate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardSpec {
    /// All episodes of a shard are of one task.
    pub task: Task,
    /// The episodes, by their index within the evaluation.
    pub episodes: Range<u32>,
    /// The perturbations.
    pub profile: Profile,
    /// The evaluation's; the episodes' derive from it.
    pub seed: Seed,
    /// The season's, of the model mismatch.
    pub mismatch_seed: Seed,
    /// More faults than this end the shard early.
    pub max_faults: u32,
}

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
