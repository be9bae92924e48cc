//! An uploaded agent and its smoke run's verdict.

use crate::views::{not_taken::NotTakenView, queue::QueueView, ruling::RulingView};
use faceoff_types::{SmokeTiming, SubmissionId, TeamId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One uploaded agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SubmissionView {
    /// Names the submission in paths.
    pub id: SubmissionId,
    /// Who uploaded it.
    pub team: TeamId,
    /// Name of the archive.
    pub file_name: String,
    /// Size of the archive in bytes.
    pub bytes: u64,
    /// BLAKE3 of the archive, 64 hexadecimal digits.
    pub blake3: String,
    /// When the upload was complete.
    pub created_at: Timestamp,
    /// The agent's own name, known once the bundle was unpacked.
    pub agent_name: Option<String>,
    /// The runtime that its `agent.toml` names; absent until that was read, and of what older versions have checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtime: Option<String>,
    /// The stages that are not over and do not take its runtime: it does not play there, and why; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_taken: Vec<NotTakenView>,
    /// How long its answers took in the smoke run, for each task that was played.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub timing: Vec<SmokeTiming>,
    /// Is it what its team enters at the next cut?
    pub active: bool,
    /// When its team took it back: it enters no further day, unless it is chosen again; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub withdrawn_at: Option<Timestamp>,
    /// What its team calls it; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// What its team writes about it; absent without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The team's first submission of the same archive, if this is another; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_as: Option<SubmissionId>,
    /// Its archive was removed, if it was: when and why; nobody plays it any more. Absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub archive_removed: Option<RulingView>,
    /// Who has deleted it, and when; absent if nobody has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deleted: Option<DeletedView>,
    /// Where its smoke run stands in the queue; absent once there is a verdict.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next.
    pub next: String,
    /// The smoke run's verdict.
    #[serde(flatten)]
    pub status: SubmissionStatus,
}

/// Who has had the archive of a submission removed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct DeletedView {
    /// When.
    pub at: Timestamp,
    /// As the log has them: `team:ID`, `person:ID` or `organiser`.
    pub by: String,
}

/// What has become of a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum SubmissionStatus {
    /// It waits for its smoke run, or is in it.
    Validating,
    /// It starts, answers and keeps time: it can be evaluated.
    Valid {
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// The bundle or the agent is at fault.
    Invalid {
        /// What is wrong and where.
        reason: String,
        /// Last part of the agent's standard error; absent in lists.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        log: Option<String>,
    },
    /// The smoke run failed by our fault, several times; upload it again.
    ValidationError {
        /// What failed.
        reason: String,
    },
}

impl SubmissionStatus {
    /// What happens to a submission next, by itself or by its team.
    pub const fn next(&self, active: bool, withdrawn: bool) -> &'static str {
        match self {
            Self::Validating => {
                "A smoke run checks whether it starts, answers and keeps time; if it is valid and the newest, it is \
             active then, by itself."
            }
            Self::Valid { .. } if active => {
                "It plays at the next cut, unless a later upload turns valid or another one is chosen before."
            }
            Self::Valid { .. } if withdrawn => {
                "It plays no further day, unless it is chosen again; a day that had its cut goes on."
            }
            Self::Valid { .. } => "It plays no further day, unless it is chosen.",
            Self::Invalid { .. } => {
                "It plays nothing: its bundle is removed. Correct what the reason names, and upload another."
            }
            Self::ValidationError { .. } => {
                "It plays nothing, by our fault: upload it again, which costs no place in the queue of pending uploads."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            let text = status.next(*active, *withdrawn);
            assert!(text.contains(words), "{words} is not in {text}");
            texts.insert(text);
        }
        assert_eq!(texts.len(), states.len(), "no two say the same");
    }
}
