//! What every decision of an organiser's has: a reason that can be read, and, where it cannot be undone, a name that
//! confirms it.

use crate::problem::Problem;

/// Longest reason of a decision.
pub(crate) const MAX_REASON_CHARS: usize = 500;

/// A reason without what surrounds it, if it is one.
pub fn checked_reason(reason: &str) -> Result<&str, Problem> {
    let reason = reason.trim();
    let chars = reason.chars().count();
    if !(1..=MAX_REASON_CHARS).contains(&chars) {
        let detail = format!("expected 1 to {MAX_REASON_CHARS} characters, got {chars}");
        return Err(Problem::invalid("reason", detail));
    }
    Ok(reason)
}

/// What a decision would do, told before it does.
#[derive(Debug, Clone)]
pub struct Stake {
    /// Whoever decides confirms with the name of what it is about.
    pub name: String,
    /// Without a full stop.
    pub what: String,
}

impl Stake {
    /// Refuses what is not confirmed, and says what it would do.
    ///
    /// # Errors
    /// `NotConfirmed`.
    pub fn check(&self, confirmed: Option<&str>) -> Result<(), Problem> {
        Problem::check_confirmed(confirmed, &self.name, &self.what)
    }
}

/// That a decision's reason is public; the reason itself, once there is one.
pub fn published(reason: Option<&str>) -> String {
    match reason {
        Some(reason) => format!("with the reason {reason:?} for everybody to read"),
        None => "with its reason for everybody to read".to_owned(),
    }
}
