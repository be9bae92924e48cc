//! Rows of the table of episodes.

use crate::{episode_text::describe_violation, figures, replay::page_path};
use faceoff_replay::{EpisodeLine, model::CONTROL_STEP_S};
use faceoff_types::{EvaluationId, Task};

/// An episode in the table.
pub(super) struct Row {
    pub(super) task: Task,
    pub(super) episode: u32,
    pub(super) path: String,
    pub(super) success: bool,
    pub(super) end_reason: String,
    pub(super) violations: Vec<String>,
    pub(super) duration_s: String,
    /// Slowest answer; only for viewers of the dataset.
    pub(super) slowest_ms: Option<String>,
}

impl Row {
    pub(super) fn new(id: EvaluationId, line: &EpisodeLine) -> Self {
        let EpisodeLine { task, episode, .. } = line;
        Self {
            task: *task,
            episode: *episode,
            path: page_path(id, *task, *episode),
            success: line.success,
            end_reason: line.why.clone(),
            violations: line.broken.iter().map(describe_violation).collect(),
            duration_s: format!("{:.2}", f64::from(line.steps) * CONTROL_STEP_S),
            slowest_ms: line.longest_s.map(figures::milliseconds),
        }
    }
}
