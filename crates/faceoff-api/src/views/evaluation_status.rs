//! What has become of an evaluation, and what happens to it next.

use crate::views::{shown, task::TaskView};
use faceoff_types::{
    AgentFault, EvaluationResult, Profile, Seed, SlotTiming, Task, Tier, Variation,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// What has become of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum EvaluationStatus {
    /// It waits for a worker.
    Queued,
    /// Episodes are being played.
    Running,
    /// All episodes are played, the score is being computed.
    Finalising,
    /// It has a score.
    Finished {
        /// When the score was published.
        finished_at: Timestamp,
        /// The score; absent while the stage is blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        result: Option<Box<ResultView>>,
        /// Path of the recorded dataset on this server; absent while the stage is blind, and once it was removed.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset: Option<String>,
        /// BLAKE3 of its archive, 64 hexadecimal digits; absent for datasets of older versions, and while the stage is
        /// blind.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset_blake3: Option<String>,
    },
    /// The agent broke the protocol or a limit too often; no score.
    AgentFailed {
        /// When the last of its faults was stored.
        finished_at: Timestamp,
        /// What the agent did; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<FaultView>>,
        /// Last part of the agent's standard error; absent in lists, and until the day is released.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// Our fault. It is played again, with the same submission on the same episodes: twice by itself,
    /// then if the organiser wants it.
    PlatformFailed {
        /// When we gave it up.
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// Its day's deadline came before all of it was played: for want of our capacity. The turn is given back.
    NotPlayed {
        /// When it was ended.
        finished_at: Timestamp,
        /// Which deadline.
        reason: String,
    },
    /// Stopped by the organiser.
    Cancelled {
        /// When it was stopped.
        finished_at: Timestamp,
        /// The organiser's words.
        reason: String,
    },
}

impl EvaluationStatus {
    /// What happens to a finished one next once its day is released.
    pub const DONE: &'static str =
        "Nothing more: its dataset is its team's, and anybody may check the score.";

    /// What happens to an evaluation next.
    pub const fn next(&self, released: bool, voided: bool) -> &'static str {
        if voided {
            return "It counts no more, and the turn is given back: the organiser may have it played again.";
        }
        match self {
            Self::Queued => {
                "Its episodes are played as soon as slots are free for its team; what its day's deadline leaves unplayed \
             is ended, and the turn given back."
            }
            Self::Running => {
                "The rest of its episodes is played, and then the score computed; what its day's deadline leaves unplayed \
             is ended, and the turn given back."
            }
            Self::Finalising => "The score is computed and published, without anybody's doing.",
            Self::Finished { .. } if released => Self::DONE,
            Self::Finished { .. } => {
                "Dataset and details come out when the last evaluation of its day has ended."
            }
            Self::AgentFailed { .. } if released => {
                "Nothing more: faults and log say what to correct; another upload plays the next day."
            }
            Self::AgentFailed { .. } => {
                "Its team sees faults and log when the last evaluation of its day has ended."
            }
            Self::PlatformFailed { .. } if released => {
                "The turn is given back: the organiser may have the same agent play the same episodes again."
            }
            Self::PlatformFailed { .. } => {
                "The same agent plays the same episodes again: by itself twice, after one minute and after ten, then if \
             the organiser wants it."
            }
            Self::NotPlayed { .. } => {
                "The turn is given back, and the row of an older day stays on the board; what is active at the next cut \
             plays the next day, and the organiser may have this one played after all."
            }
            Self::Cancelled { .. } => {
                "The turn is given back: the organiser may have the same agent play the same episodes again."
            }
        }
    }

    /// Will nothing change any more?
    #[must_use]
    pub const fn is_final(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running | Self::Finalising)
    }

    /// When its score was published; `None` without one.
    #[must_use]
    pub const fn finished_at(&self) -> Option<Timestamp> {
        match self {
            Self::Finished { finished_at, .. } => Some(*finished_at),
            _ => None,
        }
    }
}

/// The score of one evaluation; laid out as `results.json` of the dataset, of which only score and points
/// are told until the day is released.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ResultView {
    /// The rules that it was scored by.
    pub ruleset: String,
    /// The perturbations.
    pub profile: Profile,
    /// What it was played and scored by otherwise than the ruleset has it.
    #[serde(flatten)]
    pub variation: Variation,
    /// The seed of the day's evaluations, 64 hexadecimal digits; null until the day is released.
    pub seed: Option<Seed>,
    /// By task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskView>,
    /// Overall score in percent.
    pub score: f64,
    /// Penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// The worst of the tasks' tiers.
    pub tier: Tier,
    /// The slots' noise floor and re-runs; absent until the day is released, and in results of older
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<SlotTiming>,
}

impl ResultView {
    /// Of a result: before the day is released without what tells of its episodes.
    pub fn new(result: EvaluationResult, released: bool) -> Self {
        let tasks = result.tasks.iter();
        Self {
            ruleset: result.ruleset,
            profile: result.profile,
            variation: result.variation,
            seed: released.then_some(result.seed),
            tasks: tasks
                .map(|(task, result)| (*task, TaskView::new(result, released)))
                .collect(),
            score: result.score,
            penalty_points: result.penalty_points,
            tier: result.tier,
            timing: result.timing.filter(|_| released),
        }
    }
}

/// Something an agent did wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct FaultView {
    /// What it did, in words.
    pub message: String,
    /// In which task.
    pub task: String,
    /// In which episode; null during start-up.
    pub episode: Option<u32>,
    /// At which control step; null outside of an episode.
    pub step: Option<u32>,
    /// The offending line, cut, where there was one.
    pub line: Option<String>,
}

impl From<AgentFault> for FaultView {
    fn from(fault: AgentFault) -> Self {
        Self {
            message: shown(fault.fault.to_string()),
            task: fault.contest.to_string(),
            episode: fault.episode,
            step: fault.step,
            line: fault.line.map(shown),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_of_an_evaluation_says_what_happens_next() {
        let at = Timestamp::UNIX_EPOCH;
        let reason = || "a reason".to_owned();
        let finished = EvaluationStatus::Finished {
            finished_at: at,
            result: Some(Box::new(ResultView {
                ruleset: String::new(),
                profile: Profile::Evaluation,
                variation: Variation::default(),
                seed: None,
                tasks: Default::default(),
                score: 0.0,
                penalty_points: 0.0,
                tier: Tier::Deployable,
                timing: None,
            })),
            dataset: Some(String::new()),
            dataset_blake3: None,
        };
        let agent_failed = EvaluationStatus::AgentFailed {
            finished_at: at,
            faults: None,
            log: None,
        };
        let platform_failed = EvaluationStatus::PlatformFailed {
            finished_at: at,
            reason: reason(),
        };
        let not_played = EvaluationStatus::NotPlayed {
            finished_at: at,
            reason: reason(),
        };
        let cancelled = EvaluationStatus::Cancelled {
            finished_at: at,
            reason: reason(),
        };
        for (status, released, voided, words) in [
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
                "The rest of its episodes",
            ),
            (
                &EvaluationStatus::Finalising,
                false,
                false,
                "score is computed",
            ),
            (&finished, false, false, "come out when the last"),
            (&finished, true, false, "Nothing more: its dataset"),
            (&finished, true, true, "counts no more"),
            (&agent_failed, false, false, "sees faults and log when"),
            (&agent_failed, true, false, "what to correct"),
            (&platform_failed, false, false, "by itself twice"),
            (&platform_failed, true, false, "may have the same agent"),
            (&not_played, true, false, "older day stays on the board"),
            (&cancelled, true, false, "turn is given back"),
        ] {
            let text = status.next(released, voided);
            assert!(text.contains(words), "{words} is not in {text}");
        }
    }
}
