use crate::column::Instant;
use jiff::Timestamp;

/// Time and public reason of a decision, such as a disqualification, a voided result or a pause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ruling {
    pub at: Timestamp,
    /// Public.
    pub reason: String,
}

impl Ruling {
    /// Reads it from its two columns, which are set together.
    pub(crate) fn from_columns(at: Option<Instant>, reason: Option<String>) -> Option<Self> {
        let (at, reason) = (at?.0, reason?);
        Some(Self { at, reason })
    }
}
