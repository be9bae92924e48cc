//! What a team has uploaded, for itself.

use crate::views::submission::{SubmissionStatus, SubmissionView};
use faceoff_types::SubmissionId;

/// A row of the table of submissions.
pub(super) struct Entered {
    pub(super) id: SubmissionId,
    pub(super) name: String,
    pub(super) uploaded_at: String,
    pub(super) state: String,
    /// It plays at the next cut.
    pub(super) active: bool,
    pub(super) next: String,
}

/// Rows in the order of the submissions.
pub(super) fn of(submissions: Vec<SubmissionView>) -> Vec<Entered> {
    submissions.into_iter().map(entered).collect()
}

fn entered(submission: SubmissionView) -> Entered {
    let state = match &submission.status {
        _ if submission.deleted.is_some() => "deleted".to_owned(),
        _ if submission.withdrawn_at.is_some() => "withdrawn".to_owned(),
        SubmissionStatus::Validating => "in its smoke run".to_owned(),
        SubmissionStatus::Valid { .. } => "valid".to_owned(),
        SubmissionStatus::Invalid { reason, .. } => format!("invalid: {reason}"),
        SubmissionStatus::ValidationError { reason } => {
            format!("not checked, by our fault: {reason}")
        }
    };
    let agent = submission.agent_name;
    Entered {
        id: submission.id,
        name: submission.label.or(agent).unwrap_or(submission.file_name),
        uploaded_at: submission
            .created_at
            .strftime("%Y-%m-%d %H:%M UTC")
            .to_string(),
        state,
        active: submission.active,
        next: submission.next,
    }
}
