//! An episode as a row of the table.

use crate::{episode_words::in_words, figures, replay::page_path};
use faceoff_replay::{EpisodeLine, model::CONTROL_STEP_S};
use faceoff_types::{EvaluationId, Task};

pub(super) struct Row {
    pub(super) task: Task,
    pub(super) episode: u32,
    pub(super) path: String,
    pub(super) success: bool,
    pub(super) why: String,
    pub(super) broken: Vec<String>,
    pub(super) duration_s: String,
    /// ms; for whoever gets the dataset.
    pub(super) longest_ms: Option<String>,
}

impl Row {
    pub(super) fn of(id: EvaluationId, line: &EpisodeLine) -> Self {
        let EpisodeLine { task, episode, .. } = line;
        Self {
            task: *task,
            episode: *episode,
            path: page_path(id, *task, *episode),
            success: line.success,
            why: line.why.clone(),
            broken: line.broken.iter().map(in_words).collect(),
            duration_s: format!("{:.2}", f64::from(line.steps) * CONTROL_STEP_S),
            longest_ms: line.longest_s.map(figures::milliseconds),
        }
    }
}
