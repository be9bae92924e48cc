//! What replays of an evaluation's episodes are drawn from. The motion, and how each episode went, are there for everybody once the
//! day is released; what the agent was told and commanded, its times and its faults for whoever gets the dataset.

use faceoff_replay::EpisodeLine;
use faceoff_types::Task;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// How the episodes of an evaluation went, in order of task and number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EpisodesView {
    /// The episodes.
    pub episodes: Vec<EpisodeLine>,
    /// By task, for whoever gets the dataset: how many control steps were answered in which time, shortest first.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub computation_times: BTreeMap<Task, Vec<TimeBinView>>,
}

/// Control steps by the time that the agent took for its answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimeBinView {
    /// At least, s.
    pub from_s: f64,
    /// Less than, s.
    pub to_s: f64,
    /// How many.
    pub steps: u64,
}
