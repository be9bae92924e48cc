//! Rows of the table of episodes.

use super::still;
use crate::{episode_text::describe_violation, format, replay::page_path};
use faceoff_replay::EpisodeIndexEntry;
use faceoff_types::{Competition, EvaluationId, Task};

/// An episode in the table.
pub(super) struct Row {
    pub(super) task: Task,
    pub(super) episode: u32,
    /// The page of its replay, if it has one.
    pub(super) path: Option<String>,
    /// Address of a still picture, if it has a replay.
    pub(super) still: Option<String>,
    pub(super) success: bool,
    pub(super) end_reason: String,
    pub(super) violations: Vec<String>,
    pub(super) duration_s: String,
    /// Slowest answer; only for those who may see the dataset.
    pub(super) slowest_ms: Option<String>,
}

impl Row {
    pub(super) fn new(
        competition: &Competition,
        id: EvaluationId,
        summary: &EpisodeIndexEntry,
        still_version: &str,
    ) -> Self {
        let EpisodeIndexEntry { task, episode, .. } = summary;
        Self {
            task: *task,
            episode: *episode,
            path: summary.has_clips().then(|| page_path(id, *task, *episode)),
            still: summary
                .has_clips()
                .then(|| still::address(id, *task, *episode, still_version)),
            success: summary.success,
            end_reason: summary.end_description.clone(),
            violations: summary
                .violations
                .iter()
                .map(|violation| describe_violation(competition, violation))
                .collect(),
            duration_s: format!("{:.2}", competition.duration_s(*task, summary.steps)),
            slowest_ms: summary.longest_s.map(format::milliseconds),
        }
    }
}
