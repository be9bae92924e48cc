//! Decisions of organisers. Each has a public reason. For a decision that cannot be undone, the organiser first gets a preview
//! of its effects, and then confirms it with the name of the affected resource.

use crate::problem::Problem;

/// Longest reason of a decision.
pub(crate) const MAX_REASON_CHARS: usize = 500;

/// The trimmed reason, if its length is valid.
pub fn checked_reason(reason: &str) -> Result<&str, Problem> {
    let reason = reason.trim();
    let chars = reason.chars().count();
    if !(1..=MAX_REASON_CHARS).contains(&chars) {
        let detail = format!("expected 1 to {MAX_REASON_CHARS} characters, got {chars}");
        return Err(Problem::invalid("reason", detail));
    }
    Ok(reason)
}

/// The effects of a decision, before it is made.
#[derive(Debug, Clone)]
pub struct Preview {
    /// The name of the affected resource, which confirms the decision.
    pub name: String,
    /// What the decision will do, as one or more sentences; without the capital letter of the first and the full stop of the last.
    pub effect: String,
}

impl Preview {
    /// Refuses a decision that is not confirmed with the name; the message describes the effects.
    ///
    /// # Errors
    /// `NotConfirmed`.
    pub fn check_confirmed(&self, confirmed: Option<&str>) -> Result<(), Problem> {
        Problem::check_confirmed(confirmed, &self.name, &self.effect)
    }
}

/// A sentence for the description of effects, which says that the reason is public; it quotes the reason if that is already known.
pub fn reason_sentence(reason: Option<&str>) -> String {
    match reason {
        Some(reason) => format!("The reason is public: {reason:?}"),
        None => "The reason is public".to_owned(),
    }
}

/// A number of things, such as “3 evaluations”.
pub fn count_text(number: u32, thing: &str) -> String {
    match number {
        1 => format!("1 {thing}"),
        _ => format!("{number} {thing}s"),
    }
}
