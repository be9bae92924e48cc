//! Outcomes of an evaluation's episodes, and a histogram of computation times. Outcomes are public once the day is released.
//! Computation times and faults need access to the dataset.

use faceoff_replay::EpisodeIndexEntry;
use faceoff_types::Task;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The episodes of an evaluation, in order of task and number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EpisodesView {
    /// One entry per episode.
    pub episodes: Vec<EpisodeIndexEntry>,
    /// Histogram of computation times by task, shortest first; absent without access to the dataset.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub computation_times: IndexMap<Task, Vec<TimeBinView>>,
}

/// A bin of the histogram of computation times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimeBinView {
    /// Lower bound in seconds, inclusive.
    pub from_s: f64,
    /// Upper bound in seconds, exclusive.
    pub to_s: f64,
    /// Number of control steps.
    pub steps: u64,
}
