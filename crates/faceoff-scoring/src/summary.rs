//! Summaries of an evaluation's episodes: what boards and comparisons need, without the outcome of each episode.

use crate::{
    episode::{episode_penalty, has_fault},
    paired_tests::PairingError,
    successes::Successes,
    tier_change::TierChange,
};
use faceoff_types::{Competition, EpisodeOutcome, Task, TaskMap, TierBounds};
use serde::{Deserialize, Serialize};

/// Summary of an evaluation's episodes for boards and comparisons: some hundred bytes per task instead of all outcomes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeSummary {
    /// One summary for each task of the evaluation.
    pub tasks: TaskMap<TaskSummary>,
    /// As [`TaskSummary::tier_change`], for the overall tier, which is the worst of the tasks' tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier_change: Option<f64>,
}

/// Summary of the episodes of one task for boards and comparisons.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSummary {
    /// The solved episodes.
    pub successes: Successes,
    /// Penalty points over all episodes.
    pub penalty_points: f64,
    /// Probability of another tier on other episodes of the same kind, by a bootstrap with
    /// [`TIER_CHANGE_RESAMPLES`](crate::TIER_CHANGE_RESAMPLES) resamples of the episodes' penalty points; absent in a
    /// competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier_change: Option<f64>,
}

impl EpisodeSummary {
    /// Increases whenever the same outcomes would give another summary: summaries stored with another version are
    /// computed again. The outcomes of old runs are deleted, so a new version must include a migration from the
    /// previous one.
    pub const VERSION: u32 = 2;

    /// Summarises an evaluation's episodes, given in any sequence, with the tasks in the order of `tasks`; `bounds`
    /// decide the tiers; without them there are none. The same episodes give bit-identical summaries.
    ///
    /// # Errors
    /// If the episodes of a task are not 0, 1, … n − 1, each once.
    pub fn from_outcomes(
        competition: &Competition,
        outcomes: &[EpisodeOutcome],
        tasks: &[Task],
        bounds: Option<TierBounds>,
    ) -> Result<Self, PairingError> {
        let mut by_task: TaskMap<Vec<&EpisodeOutcome>> =
            tasks.iter().map(|task| (*task, Vec::new())).collect();
        for outcome in outcomes {
            by_task.entry(outcome.task).or_default().push(outcome);
        }
        by_task.retain(|_, episodes| !episodes.is_empty());
        for (task, episodes) in &mut by_task {
            episodes.sort_unstable_by_key(|outcome| outcome.episode);
            for (expected, outcome) in (0..).zip(episodes.iter()) {
                match outcome.episode.cmp(&expected) {
                    std::cmp::Ordering::Equal => {}
                    std::cmp::Ordering::Greater => {
                        return Err(PairingError::Missing(*task, expected));
                    }
                    std::cmp::Ordering::Less => {
                        return Err(PairingError::Repeated(*task, outcome.episode));
                    }
                }
            }
        }
        let points = by_task.iter().map(|(task, episodes)| {
            let points = episodes
                .iter()
                .map(|outcome| episode_penalty(competition, outcome));
            (*task, points.collect())
        });
        let points: TaskMap<Vec<f64>> = points.collect();
        let change = bounds.map(|bounds| TierChange::from_points(points, &bounds));
        let tasks = by_task.into_iter().map(|(task, episodes)| {
            let summary = TaskSummary {
                successes: episodes
                    .iter()
                    .map(|outcome| outcome.success && !has_fault(outcome))
                    .collect(),
                // Points are multiples of one half: the sum is exact in any order.
                penalty_points: episodes
                    .iter()
                    .map(|outcome| episode_penalty(competition, outcome))
                    .sum(),
                tier_change: change
                    .as_ref()
                    .map(|change| change.tasks.get(&task).copied().unwrap_or_default()),
            };
            (task, summary)
        });
        Ok(Self {
            tasks: tasks.collect(),
            tier_change: change.map(|change| change.overall),
        })
    }

    /// The probability of another tier in `task`, or of another overall tier if `task` is `None`; 0 for a missing task, and `None`
    /// without tiers.
    #[must_use]
    pub fn tier_change_of(&self, task: Option<Task>) -> Option<f64> {
        let overall = self.tier_change?;
        match task {
            None => Some(overall),
            Some(task) => match self.tasks.get(&task) {
                None => Some(0.0),
                Some(task) => task.tier_change,
            },
        }
    }
}
