//! A step of the system clock: a change of its time that the monotonic clock does not explain.

use jiff::{SignedDuration, Timestamp};
use std::fmt;

/// A step of the system clock that is not accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockStep {
    pub cause: StepCause,
    /// How far the system clock is ahead; negative: behind.
    pub by: SignedDuration,
    pub system_at: Timestamp,
    /// The time that the server uses.
    pub server_at: Timestamp,
    /// The time at the zero of the monotonic clock, by the server's time.
    pub(super) zero_at: Timestamp,
}

/// The evidence that the clock was set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepCause {
    /// The monotonic clock, which continues the server's time.
    MonotonicClock,
    /// The newest change in the database is later than the system clock's time at the start of this process. The server uses the
    /// system clock's time nevertheless, since it has no better one.
    NewestChange,
}

impl ClockStep {
    /// By how much the server's time changes if the step is accepted.
    #[must_use]
    pub const fn shift(&self) -> SignedDuration {
        match self.cause {
            StepCause::MonotonicClock => self.by,
            StepCause::NewestChange => SignedDuration::ZERO,
        }
    }

    /// Size and direction, which confirm that this step is accepted and no other: `3600 s behind`.
    #[must_use]
    pub fn size(&self) -> String {
        let direction = if self.by.is_negative() {
            "behind"
        } else {
            "ahead"
        };
        // Rounded: adjustments of the clock by a fraction of a second must not change the text.
        let seconds = (self.by.as_millis().unsigned_abs() + 500) / 1000;
        format!("{seconds} s {direction}")
    }
}

impl fmt::Display for ClockStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (size, system_at, server_at) = (self.size(), self.system_at, self.server_at);
        match self.cause {
            StepCause::MonotonicClock => write!(
                f,
                "the system clock was set and is {size} (it shows {system_at:.0}). The server continues with {server_at:.0} \
                 until the clock is right or an organiser accepts it"
            ),
            StepCause::NewestChange => write!(
                f,
                "the system clock is wrong or was wrong before: at the start it was {size}, compared with the newest change in \
                 the database (it shows {system_at:.0}). No evaluation day starts until it has caught up or an organiser accepts it"
            ),
        }
    }
}
