//! [`DecisionRecord`]: an organiser's decision with its reason.

use crate::column::Instant;
use jiff::Timestamp;

/// Time and public reason of a decision, such as a disqualification, a voided result or a pause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecisionRecord {
    /// When it was decided.
    pub at: Timestamp,
    /// Public.
    pub reason: String,
}

impl DecisionRecord {
    /// Reads a decision from its two columns, which are set together.
    pub(crate) fn from_columns(at: Option<Instant>, reason: Option<String>) -> Option<Self> {
        let (at, reason) = (at?.0, reason?);
        Some(Self { at, reason })
    }
}
