use crate::column::Instant;
use jiff::Timestamp;

/// What the organiser has decided against a result or a team.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ruling {
    pub at: Timestamp,
    /// Everybody may read it.
    pub reason: String,
}

impl Ruling {
    /// From its two columns, which are set together.
    pub(crate) fn of(at: Option<Instant>, reason: Option<String>) -> Option<Self> {
        let (at, reason) = (at?.0, reason?);
        Some(Self { at, reason })
    }
}
