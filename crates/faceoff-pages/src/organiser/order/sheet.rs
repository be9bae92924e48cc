//! What every decision tells before it is taken.

use faceoff_service::acts::deciding::Stake;
use faceoff_types::StageDay;

/// A decision as its page tells it before it is taken.
pub(in crate::organiser) struct Sheet {
    pub(in crate::organiser) title: String,
    pub(in crate::organiser) what: String,
    /// Who reads the reason, where one is wanted.
    pub(in crate::organiser) reason: Option<&'static str>,
    /// The name that confirms it, where one is wanted.
    pub(in crate::organiser) confirm: Option<String>,
    pub(in crate::organiser) button: &'static str,
    /// It cannot be undone, or hits a team at once.
    pub(in crate::organiser) is_grave: bool,
    /// Where one came from, and goes back to.
    pub(in crate::organiser) back: String,
}

/// Who reads a reason.
pub(super) const EVERYBODY: &str = "everybody may read it";

/// The page of a day.
pub(super) fn day_page(of: StageDay) -> String {
    format!("/organiser/day?stage={}&day={}", of.stage, of.date)
}

/// A stake's words, as a sentence.
pub(super) fn sentence(stake: &Stake) -> String {
    let mut chars = stake.what.chars();
    let first: String = chars
        .next()
        .into_iter()
        .flat_map(char::to_uppercase)
        .collect();
    format!("{first}{}.", chars.as_str())
}
