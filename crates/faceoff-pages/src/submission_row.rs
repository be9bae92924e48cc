//! A row of a list of submissions: an uploaded agent with its state, and the actions that are possible.

use super::{dashboard_frame, format::utc_minute};
use faceoff_api::views::submission::{SubmissionStatus, SubmissionView};
use faceoff_types::SubmissionId;

pub(super) struct SubmissionRow {
    pub(super) id: SubmissionId,
    pub(super) name: String,
    /// File name and size of the bundle.
    pub(super) file: String,
    pub(super) uploaded_at: String,
    pub(super) state: &'static str,
    /// CSS class of the state.
    pub(super) class: &'static str,
    /// Why it is invalid or was not validated.
    pub(super) reason: Option<String>,
    pub(super) queue_position: Option<String>,
    /// What the team can do next, as a sentence.
    pub(super) next_step: String,
    /// Is it the submission that is evaluated at the next cutoff?
    pub(super) is_active: bool,
    pub(super) can_activate: bool,
    pub(super) can_withdraw: bool,
    /// Can the bundle be downloaded?
    pub(super) has_bundle: bool,
}

impl From<&SubmissionView> for SubmissionRow {
    fn from(view: &SubmissionView) -> Self {
        let is_deleted = view.bundle_removed.is_some();
        let is_valid = matches!(view.status, SubmissionStatus::Valid { .. });
        let is_withdrawn = view.withdrawn_at.is_some();
        let (state, class, reason) = match &view.status {
            _ if view.deleted.is_some() => ("deleted", "plain", None),
            _ if is_withdrawn => ("withdrawn", "plain", None),
            SubmissionStatus::Validating => ("validating", "waiting", None),
            SubmissionStatus::Valid { .. } => ("valid", "good", None),
            SubmissionStatus::Invalid { reason, .. } => ("invalid", "bad", Some(reason.clone())),
            SubmissionStatus::PlatformFailed { reason } => (
                "not validated (platform fault)",
                "bad",
                Some(reason.clone()),
            ),
        };
        let queue_position = view.queue.map(|queue| {
            let expected = match queue.expected_at {
                Some(at) => format!("result expected {}", utc_minute(at)),
                None => "expected time not known yet".to_owned(),
            };
            format!(
                "Position {} of {} in the validation queue; {expected}",
                queue.position, queue.total
            )
        });
        let name = view.label.clone().or_else(|| view.agent_name.clone());
        Self {
            id: view.id,
            name: name.unwrap_or_else(|| view.file_name.clone()),
            file: format!("{}, {}", view.file_name, dashboard_frame::bytes(view.bytes)),
            uploaded_at: utc_minute(view.created_at),
            state,
            class,
            reason,
            queue_position,
            next_step: view.next.clone(),
            is_active: view.active,
            can_activate: is_valid && !is_deleted && !view.active,
            can_withdraw: is_valid && !is_deleted && !is_withdrawn,
            has_bundle: !is_deleted && !matches!(view.status, SubmissionStatus::Invalid { .. }),
        }
    }
}
