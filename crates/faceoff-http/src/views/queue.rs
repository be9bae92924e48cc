//! Where something stands in the queue, and what happens to it next.

use super::{
    evaluation::{EvaluationStatus, EvaluationView},
    submission::{SubmissionStatus, SubmissionView},
};
use crate::{app::AppState, problem::Problem};
use faceoff_store::{Outlook, QueuePlace};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Where something that waits, or is under way, stands among all of its sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct QueueView {
    /// From 1: the how manieth to be over, if nothing is added; smoke runs and evaluations each for themselves.
    pub place: u32,
    /// Of how many that are not over.
    pub of: u32,
    /// When it will be over, by what such work took in the last seven days; null while the queue is paused, and
    /// where something that comes before it was never measured.
    pub expected_at: Option<Timestamp>,
}

impl From<QueuePlace> for QueueView {
    fn from(place: QueuePlace) -> Self {
        Self {
            place: place.place,
            of: place.of,
            expected_at: place.expected_at,
        }
    }
}

pub(crate) async fn outlook(app: &AppState) -> Result<Outlook, Problem> {
    let now = app.config.clock.now();
    Ok(app.store.outlook(app.config.capacity.slots, now).await?)
}

/// Tells of those that are under way where they stand. If all are over, nothing is read.
pub(crate) async fn place_evaluations(
    app: &AppState,
    views: &mut [EvaluationView],
) -> Result<(), Problem> {
    if views.iter().all(|view| view.status.is_final()) {
        return Ok(());
    }
    let outlook = outlook(app).await?;
    for view in views {
        view.queue = outlook.evaluations.get(&view.id).copied().map(Into::into);
    }
    Ok(())
}

/// The same of submissions that wait for their smoke run.
pub(crate) async fn place_submissions(
    app: &AppState,
    views: &mut [SubmissionView],
) -> Result<(), Problem> {
    if views
        .iter()
        .all(|view| view.status != SubmissionStatus::Validating)
    {
        return Ok(());
    }
    let outlook = outlook(app).await?;
    for view in views {
        view.queue = outlook.submissions.get(&view.id).copied().map(Into::into);
    }
    Ok(())
}

/// What happens to a submission next, by itself or by its team.
pub(crate) const fn next_of_submission(
    status: &SubmissionStatus,
    active: bool,
    withdrawn: bool,
) -> &'static str {
    match status {
        SubmissionStatus::Validating => {
            "A smoke run checks whether it starts, answers and keeps time; if it is valid and the newest, it is \
             active then, by itself."
        }
        SubmissionStatus::Valid { .. } if active => {
            "It plays at the next cut, unless a later upload turns valid or another one is chosen before."
        }
        SubmissionStatus::Valid { .. } if withdrawn => {
            "It plays no further day, unless it is chosen again; a day that had its cut goes on."
        }
        SubmissionStatus::Valid { .. } => "It plays no further day, unless it is chosen.",
        SubmissionStatus::Invalid { .. } => {
            "It plays nothing: its bundle is removed. Correct what the reason names, and upload another."
        }
        SubmissionStatus::ValidationError { .. } => {
            "It plays nothing, by our fault: upload it again, which costs no place in the queue of pending uploads."
        }
    }
}

/// What happens to an evaluation next.
pub(crate) const fn next_of_evaluation(
    status: &EvaluationStatus,
    released: bool,
    voided: bool,
) -> &'static str {
    if voided {
        return "It counts no more, and the turn is given back: the organiser may have it played again.";
    }
    match status {
        EvaluationStatus::Queued => {
            "Its episodes are played as soon as slots are free for its team; what its day's deadline leaves unplayed \
             is ended, and the turn given back."
        }
        EvaluationStatus::Running => {
            "The rest of its episodes is played, and then the score computed; what its day's deadline leaves unplayed \
             is ended, and the turn given back."
        }
        EvaluationStatus::Finalising => {
            "The score is computed and published, without anybody's doing."
        }
        EvaluationStatus::Finished { .. } if released => {
            "Nothing more: its dataset is its team's, and anybody may check the score."
        }
        EvaluationStatus::Finished { .. } => {
            "Dataset and details come out when the last evaluation of its day has ended."
        }
        EvaluationStatus::AgentFailed { .. } if released => {
            "Nothing more: faults and log say what to correct; another upload plays the next day."
        }
        EvaluationStatus::AgentFailed { .. } => {
            "Its team sees faults and log when the last evaluation of its day has ended."
        }
        EvaluationStatus::PlatformFailed { .. } if released => {
            "The turn is given back: the organiser may have the same agent play the same episodes again."
        }
        EvaluationStatus::PlatformFailed { .. } => {
            "The same agent plays the same episodes again: by itself twice, after one minute and after ten, then if \
             the organiser wants it."
        }
        EvaluationStatus::NotPlayed { .. } => {
            "The turn is given back, and the row of an older day stays on the board; what is active at the next cut \
             plays the next day, and the organiser may have this one played after all."
        }
        EvaluationStatus::Cancelled { .. } => {
            "The turn is given back: the organiser may have the same agent play the same episodes again."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::views::evaluation::ResultView;
    use faceoff_types::{Profile, Tier};
    use std::collections::BTreeSet;

    #[test]
    fn every_state_of_a_submission_says_what_happens_next() {
        let reason = || "a reason".to_owned();
        let states = [
            (SubmissionStatus::Validating, false, false, "smoke run"),
            (
                SubmissionStatus::Valid { log: None },
                true,
                false,
                "next cut",
            ),
            (
                SubmissionStatus::Valid { log: None },
                false,
                true,
                "chosen again",
            ),
            (
                SubmissionStatus::Valid { log: None },
                false,
                false,
                "unless it is chosen.",
            ),
            (
                SubmissionStatus::Invalid {
                    reason: reason(),
                    log: None,
                },
                false,
                false,
                "upload another",
            ),
            (
                SubmissionStatus::ValidationError { reason: reason() },
                false,
                false,
                "our fault",
            ),
        ];
        let mut texts = BTreeSet::new();
        for (status, active, withdrawn, words) in &states {
            let text = next_of_submission(status, *active, *withdrawn);
            assert!(text.contains(words), "{words} is not in {text}");
            texts.insert(text);
        }
        assert_eq!(texts.len(), states.len(), "no two say the same");
    }

    #[test]
    fn every_state_of_an_evaluation_says_what_happens_next() {
        let at = Timestamp::UNIX_EPOCH;
        let reason = || "a reason".to_owned();
        let finished = EvaluationStatus::Finished {
            finished_at: at,
            result: Box::new(ResultView {
                ruleset: String::new(),
                profile: Profile::Evaluation,
                seed: None,
                tasks: Default::default(),
                score: 0.0,
                penalty_points: 0.0,
                tier: Tier::Deployable,
                timing: None,
            }),
            dataset: String::new(),
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
            let text = next_of_evaluation(status, released, voided);
            assert!(text.contains(words), "{words} is not in {text}");
        }
    }
}
