//! States of an evaluation, with its result or failure, and what happens next. The results of an evaluation day are
//! *released* (made public) once all its evaluations have ended.

use crate::views::{printable, task::TaskView};
use faceoff_types::{
    AgentFault, EvaluationResult, Profile, Seed, SlotTiming, Task, Tier, Variation,
};
use indexmap::IndexMap;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// State of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum EvaluationStatus {
    /// Waiting for a worker.
    Queued,
    /// Episodes are running.
    Running,
    /// All episodes are done; the score is being computed.
    #[serde(rename = "finalising")]
    Scoring,
    /// It has a score.
    Finished {
        /// When the score was stored.
        finished_at: Timestamp,
        /// The score; absent while the stage is blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        result: Option<Box<ResultView>>,
        /// Path of the recorded dataset on this server; absent while the stage is blind, and once the dataset was
        /// removed.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset: Option<String>,
        /// BLAKE3 hash of the dataset file, 64 hexadecimal digits; absent while the stage is blind, and for datasets of
        /// older versions.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset_blake3: Option<String>,
    },
    /// The agent violated the protocol or exceeded a limit too often; no score.
    AgentFailed {
        /// When the last fault was stored.
        finished_at: Timestamp,
        /// The agent's faults; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<FaultView>>,
        /// Last part of the agent's standard error; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// A platform fault. The evaluation is repeated with the same submission on the same episodes: twice automatically,
    /// then on an organiser's request.
    PlatformFailed {
        /// When the evaluation was given up.
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// The day's deadline came before the evaluation finished, for lack of server capacity. It does not count as the
    /// team's evaluation of the day.
    #[serde(rename = "not_played")]
    DeadlineMissed {
        /// When it was ended.
        finished_at: Timestamp,
        /// The deadline, in words.
        reason: String,
    },
    /// Cancelled by an organiser.
    Cancelled {
        /// When it was cancelled.
        finished_at: Timestamp,
        /// The organiser's reason.
        reason: String,
    },
}

impl EvaluationStatus {
    /// What happens next to a finished evaluation of a released day.
    pub const DONE: &'static str = "Done. The team can download the dataset and verify the score.";

    /// What happens next to an evaluation, in words.
    pub const fn next(&self, is_released: bool, is_voided: bool) -> &'static str {
        if is_voided {
            return "It no longer counts as the team's evaluation of the day. An organiser can repeat it.";
        }
        match self {
            Self::Queued => {
                "Its episodes start as soon as slots are free for the team. If they are not done by the day's deadline, \
             the evaluation is ended and does not count."
            }
            Self::Running => {
                "The remaining episodes run, then the score is computed. If they are not done by the day's deadline, \
             the evaluation is ended and does not count."
            }
            Self::Scoring => "The score is computed and published automatically.",
            Self::Finished { .. } if is_released => Self::DONE,
            Self::Finished { .. } => {
                "Dataset and details are released when the day's last evaluation has ended."
            }
            Self::AgentFailed { .. } if is_released => {
                "Done. Faults and log show what to correct; a corrected submission is evaluated on the next day."
            }
            Self::AgentFailed { .. } => {
                "The team sees faults and log when the day's last evaluation has ended."
            }
            Self::PlatformFailed { .. } if is_released => {
                "It does not count as the team's evaluation of the day. An organiser can repeat it with the same \
             submission on the same episodes."
            }
            Self::PlatformFailed { .. } => {
                "The same submission is evaluated again on the same episodes: twice automatically, after one and after \
             ten minutes, then on an organiser's request."
            }
            Self::DeadlineMissed { .. } => {
                "It does not count as the team's evaluation of the day, and the row of an earlier day stays on the board. \
             The next cutoff evaluates the active submission. An organiser can still repeat this evaluation."
            }
            Self::Cancelled { .. } => {
                "It does not count as the team's evaluation of the day. An organiser can repeat it with the same \
             submission on the same episodes."
            }
        }
    }

    /// Whether the state is final.
    #[must_use]
    pub const fn is_final(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running | Self::Scoring)
    }

    /// When the score was stored; `None` without a score.
    #[must_use]
    pub const fn finished_at(&self) -> Option<Timestamp> {
        match self {
            Self::Finished { finished_at, .. } => Some(*finished_at),
            _ => None,
        }
    }
}

/// The score of an evaluation, in the layout of the dataset's `results.json`. Until the day is released only scores and
/// points are present.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ResultView {
    /// The ruleset of the score.
    pub ruleset: String,
    /// Perturbation profile of the simulator.
    pub profile: Profile,
    /// Settings that differ from the ruleset's.
    #[serde(flatten)]
    pub variation: Variation,
    /// The seed of the day's evaluations, 64 hexadecimal digits; null until the day is released.
    pub seed: Option<Seed>,
    /// By task.
    pub tasks: IndexMap<Task, TaskView>,
    /// Overall score in percent.
    pub score: f64,
    /// Penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// The worst of the tasks' tiers; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// How exactly the slots (places that run jobs) measured answer times, and how many episodes they repeated; absent
    /// until the day is released, and in results of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<SlotTiming>,
}

impl ResultView {
    /// The view of a result. The details are left out unless the day is released.
    pub fn new(result: EvaluationResult, is_released: bool) -> Self {
        let tasks = result.tasks.iter();
        Self {
            ruleset: result.ruleset,
            profile: result.profile,
            variation: result.variation,
            seed: is_released.then_some(result.seed),
            tasks: tasks
                .map(|(task, result)| (*task, TaskView::new(result, is_released)))
                .collect(),
            score: result.score,
            penalty_points: result.penalty_points,
            tier: result.tier,
            timing: result.timing.filter(|_| is_released),
        }
    }
}

/// A fault of an agent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FaultView {
    /// The fault, in words.
    pub message: String,
    /// The task.
    pub task: String,
    /// The episode, from 0; null during start-up.
    pub episode: Option<u32>,
    /// The control step; null outside of an episode.
    pub step: Option<u32>,
    /// The offending line of output, truncated; null without one.
    pub line: Option<String>,
}

impl From<AgentFault> for FaultView {
    fn from(fault: AgentFault) -> Self {
        Self {
            message: printable(fault.fault.to_string()),
            task: fault.agent_task.to_string(),
            episode: fault.episode,
            step: fault.step,
            line: fault.line.map(printable),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_step_is_described_for_each_evaluation_state() {
        let finished_at = Timestamp::UNIX_EPOCH;
        let reason = || "a reason".to_owned();
        let finished = EvaluationStatus::Finished {
            finished_at,
            result: Some(Box::new(ResultView {
                ruleset: String::new(),
                profile: Profile::new("evaluation"),
                variation: Variation::default(),
                seed: None,
                tasks: Default::default(),
                score: 0.0,
                penalty_points: 0.0,
                tier: Some(Tier::Deployable),
                timing: None,
            })),
            dataset: Some(String::new()),
            dataset_blake3: None,
        };
        let agent_failed = EvaluationStatus::AgentFailed {
            finished_at,
            faults: None,
            log: None,
        };
        let platform_failed = EvaluationStatus::PlatformFailed {
            finished_at,
            reason: reason(),
        };
        let deadline_missed = EvaluationStatus::DeadlineMissed {
            finished_at,
            reason: reason(),
        };
        let cancelled = EvaluationStatus::Cancelled {
            finished_at,
            reason: reason(),
        };
        for (status, is_released, is_voided, words) in [
            (
                &EvaluationStatus::Queued,
                false,
                false,
                "as soon as slots are free",
            ),
            (
                &EvaluationStatus::Running,
                false,
                false,
                "The remaining episodes",
            ),
            (
                &EvaluationStatus::Scoring,
                false,
                false,
                "score is computed",
            ),
            (&finished, false, false, "are released when the day's last"),
            (&finished, true, false, "can download the dataset"),
            (&finished, true, true, "no longer counts"),
            (&agent_failed, false, false, "sees faults and log when"),
            (&agent_failed, true, false, "what to correct"),
            (&platform_failed, false, false, "twice automatically"),
            (&platform_failed, true, false, "can repeat it"),
            (
                &deadline_missed,
                true,
                false,
                "earlier day stays on the board",
            ),
            (&cancelled, true, false, "does not count"),
        ] {
            let text = status.next(is_released, is_voided);
            assert!(text.contains(words), "{words} is not in {text}");
        }
    }
}
