use crate::{
    episode::{episode_penalty, has_fault},
    paired::PairingError,
    successes::Successes,
    tier_change::TierChange,
};
use faceoff_types::{EpisodeOutcome, Task, TierBounds};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What boards and comparisons need of an evaluation's episodes: some hundred bytes per task instead of
/// all outcomes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeSummary {
    /// By task played.
    pub tasks: BTreeMap<Task, TaskSummary>,
    /// As [`TaskSummary::tier_change`], of the overall tier: the worst of the tasks'.
    pub tier_change: f64,
}

/// What boards and comparisons need of the episodes of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSummary {
    /// Which episodes were solved.
    pub successes: Successes,
    /// Penalty points over all episodes.
    pub penalty_points: f64,
    /// Probability that other episodes of the same kind would put the agent in another tier, by a
    /// bootstrap of [`TIER_CHANGE_RESAMPLES`](crate::TIER_CHANGE_RESAMPLES) resamples of the episodes'
    /// penalty points.
    pub tier_change: f64,
}

impl EpisodeSummary {
    /// Changes whenever the same outcomes would give another summary: one that was stored under
    /// another version is to be made again. Of runs that are long over the outcomes are gone: a new version has to
    /// come with a way to make it of the one before.
    pub const VERSION: u32 = 2;

    /// Sums up an evaluation's episodes, given in any order, whose tiers are by these bounds. The same episodes give the same summary,
    /// to the last bit.
    ///
    /// # Errors
    /// If a task's episodes are not 0, 1, … n − 1, each once.
    pub fn of(outcomes: &[EpisodeOutcome], bounds: &TierBounds) -> Result<Self, PairingError> {
        let mut by_task = BTreeMap::<Task, Vec<&EpisodeOutcome>>::new();
        for outcome in outcomes {
            by_task.entry(outcome.task).or_default().push(outcome);
        }
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
            let points = episodes.iter().map(|outcome| episode_penalty(outcome));
            (*task, points.collect())
        });
        let change = TierChange::of(points.collect(), bounds);
        let tasks = by_task.into_iter().map(|(task, episodes)| {
            let summary = TaskSummary {
                successes: episodes
                    .iter()
                    .map(|outcome| outcome.success && !has_fault(outcome))
                    .collect(),
                // Multiples of one half: the sum is exact in any order.
                penalty_points: episodes
                    .iter()
                    .map(|outcome| episode_penalty(outcome))
                    .sum(),
                tier_change: change.tasks.get(&task).copied().unwrap_or_default(),
            };
            (task, summary)
        });
        Ok(Self {
            tasks: tasks.collect(),
            tier_change: change.overall,
        })
    }

    /// The probability of another tier: of `task`, or overall. A task that was not played has none.
    #[must_use]
    pub fn tier_change_of(&self, task: Option<Task>) -> f64 {
        match task {
            None => self.tier_change,
            Some(task) => self.tasks.get(&task).map_or(0.0, |task| task.tier_change),
        }
    }
}
