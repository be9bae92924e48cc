//! Submissions, and the verdicts of their validation runs, which check whether an upload can be evaluated.

use crate::views::{decision::DecisionView, exclusion::StageExclusion, queue::QueueView};
use faceoff_types::{SubmissionId, TeamId, ValidationTiming, deprecated_names};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct SubmissionView {
    /// Id of the submission.
    pub id: SubmissionId,
    /// Id of its team.
    pub team: TeamId,
    /// File name of the bundle.
    pub file_name: String,
    /// Size of the packed bundle in bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the packed bundle, 64 hexadecimal digits.
    pub blake3: String,
    /// When the upload was complete.
    pub created_at: Timestamp,
    /// Name of the agent, from its bundle; null until that is unpacked.
    pub agent_name: Option<String>,
    /// The runtime that its `agent.toml` names; absent until that is read, and for submissions of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtime: Option<String>,
    /// Stages that have not ended and exclude its runtime, and why; absent if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excluded_by: Vec<StageExclusion>,
    /// Computation times in the validation run, for each task.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub timing: Vec<ValidationTiming>,
    /// Whether it is the team's active submission, which the next cutoff evaluates.
    pub active: bool,
    /// When the team withdrew it: it is not evaluated again unless the team activates it; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub withdrawn_at: Option<Timestamp>,
    /// The team's name for it; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The team's note about it; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The team's first submission of an identical bundle; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_as: Option<SubmissionId>,
    /// If its bundle was removed: when, and why. It cannot be evaluated any more. Absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bundle_removed: Option<DecisionView>,
    /// If it was deleted: when, and by whom; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deleted: Option<DeletionView>,
    /// Position of its validation run in the queue; absent once there is a verdict.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next, in words.
    pub next: String,
    /// The verdict of its validation run.
    #[serde(flatten)]
    pub status: SubmissionStatus,
}
deprecated_names!(SubmissionView { not_taken => excluded_by, archive_removed => bundle_removed });

/// The deletion of a submission's bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct DeletionView {
    /// When it was deleted.
    pub at: Timestamp,
    /// Who deleted it, as the event log writes actors: `team:ID`, `person:ID` or `organiser`.
    pub by: String,
}

/// State of a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum SubmissionStatus {
    /// Its validation run is pending or running.
    Validating,
    /// It starts, answers and keeps the time limits: it can be evaluated.
    Valid {
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// The bundle or the agent is faulty.
    Invalid {
        /// What is wrong, and where.
        reason: String,
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// The validation run failed several times by a platform fault; upload the bundle again.
    #[serde(rename = "validation_error")]
    PlatformFailed {
        /// What failed.
        reason: String,
    },
}

impl SubmissionStatus {
    /// What happens next to a submission, automatically or by its team, in words.
    pub const fn next(&self, is_active: bool, is_withdrawn: bool) -> &'static str {
        match self {
            Self::Validating => {
                "A validation run checks whether it starts, answers and keeps the time limits. If it is valid and the \
             newest submission, it is activated automatically."
            }
            Self::Valid { .. } if is_active => {
                "It is evaluated at the next cutoff, unless a newer submission becomes valid or the team activates \
             another one before."
            }
            Self::Valid { .. } if is_withdrawn => {
                "It is not evaluated again, unless the team activates it. An evaluation whose cutoff has passed continues."
            }
            Self::Valid { .. } => "Not in use: it is evaluated only if the team activates it.",
            Self::Invalid { .. } => {
                "Rejected, and its bundle was deleted. Fix the error in the reason and upload again."
            }
            Self::PlatformFailed { .. } => {
                "The validation run failed because of a platform fault. Upload the bundle again; this one does not count as a \
             pending submission."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn next_step_is_described_for_each_submission_state() {
        let reason = || "a reason".to_owned();
        let states = [
            (SubmissionStatus::Validating, false, false, "validation run"),
            (
                SubmissionStatus::Valid { log: None },
                true,
                false,
                "next cutoff",
            ),
            (
                SubmissionStatus::Valid { log: None },
                false,
                true,
                "not evaluated again",
            ),
            (
                SubmissionStatus::Valid { log: None },
                false,
                false,
                "Not in use",
            ),
            (
                SubmissionStatus::Invalid {
                    reason: reason(),
                    log: None,
                },
                false,
                false,
                "upload again",
            ),
            (
                SubmissionStatus::PlatformFailed { reason: reason() },
                false,
                false,
                "platform fault",
            ),
        ];
        let mut texts = BTreeSet::new();
        for (status, is_active, is_withdrawn, words) in &states {
            let text = status.next(*is_active, *is_withdrawn);
            assert!(text.contains(words), "{words} is not in {text}");
            texts.insert(text);
        }
        assert_eq!(texts.len(), states.len(), "each text is unique");
    }
}
