//! The preview of a decision: what it will do, before an organiser confirms it.

use crate::format;
use faceoff_service::services::decision_preview::Preview;
use faceoff_types::StageDay;

/// Content of the page of a decision.
pub(in crate::organiser) struct DecisionPreview {
    pub(in crate::organiser) title: String,
    /// What the decision will do, as sentences.
    pub(in crate::organiser) effects: String,
    /// Who can read the reason; `None` if the decision needs no reason.
    pub(in crate::organiser) reason_readers: Option<&'static str>,
    /// The name that the organiser has to type as confirmation, if one is needed.
    pub(in crate::organiser) confirm_name: Option<String>,
    pub(in crate::organiser) button: &'static str,
    /// The decision is irreversible or affects a team at once.
    pub(in crate::organiser) is_grave: bool,
    /// Path of the page to return to.
    pub(in crate::organiser) return_path: String,
}

impl DecisionPreview {
    /// A decision that needs no reason and no confirmation, and is not grave. The caller sets its texts.
    pub(super) fn new(return_path: impl Into<String>) -> Self {
        Self {
            title: String::new(),
            effects: String::new(),
            reason_readers: None,
            confirm_name: None,
            button: "",
            is_grave: false,
            return_path: return_path.into(),
        }
    }

    /// A decision with these effects, which the organiser must confirm with the name of its subject.
    pub(super) fn needing_confirmation(effects: Preview, return_path: impl Into<String>) -> Self {
        Self {
            effects: format::sentence(&effects.effect),
            confirm_name: Some(effects.name),
            is_grave: true,
            ..Self::new(return_path)
        }
    }
}

/// What the browser gets after a decision was carried out: a redirect with a notice.
pub(in crate::organiser) struct DecisionOutcome {
    /// Key of the notice on that page, in `dashboard_frame.rs`.
    pub(in crate::organiser) notice: &'static str,
    /// Path of the page to which the browser is redirected.
    pub(in crate::organiser) return_path: String,
}

impl DecisionOutcome {
    pub(super) fn new(notice: &'static str, return_path: impl Into<String>) -> Self {
        Self {
            notice,
            return_path: return_path.into(),
        }
    }
}

/// Value of `reason_readers` for a reason that everyone can see.
pub(super) const PUBLIC_REASON: &str = "public";

/// Path of the page of an evaluation day.
pub(super) fn day_page(day: StageDay) -> String {
    format!("/organiser/day?stage={}&day={}", day.stage, day.date)
}
