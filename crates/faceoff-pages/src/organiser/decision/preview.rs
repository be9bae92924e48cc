//! The preview of a decision: what it will do, before an organiser confirms it.

use crate::format;
use faceoff_service::services::decision_preview::Preview;
use faceoff_types::StageDay;

/// Content of the page of a decision.
pub(in crate::organiser) struct DecisionPreview {
    pub(in crate::organiser) title: String,
    pub(in crate::organiser) effects: String,
    /// Who can read the reason; `None` if the decision needs no reason.
    pub(in crate::organiser) reason_readers: Option<&'static str>,
    /// The name that confirms the decision, if a confirmation is needed.
    pub(in crate::organiser) confirm_name: Option<String>,
    pub(in crate::organiser) button: &'static str,
    /// The decision is irreversible or affects a team at once.
    pub(in crate::organiser) is_grave: bool,
    /// Path of the page to return to.
    pub(in crate::organiser) return_path: String,
}

impl DecisionPreview {
    /// A decision without a reason, a confirmation and consequences, still without its texts.
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

/// A decision that was carried out.
pub(in crate::organiser) struct Done {
    /// Key of the notice that says so.
    pub(in crate::organiser) notice: &'static str,
    /// Path of the page to return to.
    pub(in crate::organiser) return_path: String,
}

impl Done {
    pub(super) fn new(notice: &'static str, return_path: impl Into<String>) -> Self {
        Self {
            notice,
            return_path: return_path.into(),
        }
    }
}

/// Readers of a reason that everyone can see.
pub(super) const PUBLIC_REASON: &str = "public";

/// Path of the page of an evaluation day.
pub(super) fn day_page(day: StageDay) -> String {
    format!("/organiser/day?stage={}&day={}", day.stage, day.date)
}
