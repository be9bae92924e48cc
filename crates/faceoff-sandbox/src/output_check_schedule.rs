//! Schedule of the checks whether a silent agent has closed its output.

use std::time::{Duration, Instant};

/// Interval before the first check; it doubles after each check.
const FIRST_INTERVAL: Duration = Duration::from_millis(100);

/// Time of the next check whether a silent agent has closed its output, with exponential back-off.
#[derive(Debug)]
pub(crate) struct OutputCheckSchedule {
    pub next_check_at: Instant,
    interval: Duration,
}

impl OutputCheckSchedule {
    /// Starts when the agent gets a question.
    pub fn start(now: Instant) -> Self {
        Self {
            next_check_at: now + FIRST_INTERVAL,
            interval: FIRST_INTERVAL,
        }
    }

    /// Schedules the next check, after one that found the output open.
    pub fn lengthen(&mut self, now: Instant) {
        self.interval *= 2;
        self.next_check_at = now + self.interval;
    }
}
