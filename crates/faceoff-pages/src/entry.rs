//! What a team has uploaded, as its lists show it.

use super::{desk_frame, figures::minute};
use faceoff_api::views::submission::{SubmissionStatus, SubmissionView};
use faceoff_types::SubmissionId;

/// A submission in a list.
pub(super) struct Entry {
    pub(super) id: SubmissionId,
    pub(super) name: String,
    pub(super) file: String,
    pub(super) uploaded_at: String,
    pub(super) state: &'static str,
    /// How that is coloured, beside its word.
    pub(super) class: &'static str,
    pub(super) reason: Option<String>,
    pub(super) place: Option<String>,
    pub(super) next: String,
    pub(super) is_active: bool,
    pub(super) can_activate: bool,
    pub(super) can_withdraw: bool,
    pub(super) has_archive: bool,
}

impl From<&SubmissionView> for Entry {
    fn from(view: &SubmissionView) -> Self {
        let is_gone = view.archive_removed.is_some();
        let is_valid = matches!(view.status, SubmissionStatus::Valid { .. });
        let is_withdrawn = view.withdrawn_at.is_some();
        let (state, class, reason) = match &view.status {
            _ if view.deleted.is_some() => ("deleted", "plain", None),
            _ if is_withdrawn => ("withdrawn", "plain", None),
            SubmissionStatus::Validating => ("in its smoke run", "waiting", None),
            SubmissionStatus::Valid { .. } => ("valid", "good", None),
            SubmissionStatus::Invalid { reason, .. } => ("invalid", "bad", Some(reason.clone())),
            SubmissionStatus::ValidationError { reason } => (
                "not checked, by the server’s fault",
                "bad",
                Some(reason.clone()),
            ),
        };
        let place = view.queue.map(|queue| {
            let when = match queue.expected_at {
                Some(at) => format!("verdict expected {}", minute(at)),
                None => "nobody can tell yet when its verdict comes".to_owned(),
            };
            format!("Number {} of {} smoke runs; {when}", queue.place, queue.of)
        });
        let named = view.label.clone().or_else(|| view.agent_name.clone());
        Self {
            id: view.id,
            name: named.unwrap_or_else(|| view.file_name.clone()),
            file: format!("{}, {}", view.file_name, desk_frame::bytes(view.bytes)),
            uploaded_at: minute(view.created_at),
            state,
            class,
            reason,
            place,
            next: view.next.clone(),
            is_active: view.active,
            can_activate: is_valid && !is_gone && !view.active,
            can_withdraw: is_valid && !is_gone && !is_withdrawn,
            has_archive: !is_gone && !matches!(view.status, SubmissionStatus::Invalid { .. }),
        }
    }
}
