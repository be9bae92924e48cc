//! What a steady clock (one that does not follow steps of the system clock) knows at its start.

use jiff::Timestamp;

/// What is known about the time before the first reading of a steady clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ClockStart {
    /// The time at the zero of the monotonic clock, if an earlier process of the same boot of the machine has recorded it.
    pub zero_at: Option<Timestamp>,
    /// The time of the newest change in the database.
    pub newest_change_at: Option<Timestamp>,
}
