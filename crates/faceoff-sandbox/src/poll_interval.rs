use std::time::{Duration, Instant};

/// Interval before the first check; it doubles after each check.
const FIRST_INTERVAL: Duration = Duration::from_millis(100);

/// Time of the next check whether a silent agent has closed its output, with exponential back-off.
#[derive(Debug)]
pub(crate) struct PollInterval {
    pub due: Instant,
    pause: Duration,
}

impl PollInterval {
    /// Starts when the agent gets a question.
    pub fn start(now: Instant) -> Self {
        Self {
            due: now + FIRST_INTERVAL,
            pause: FIRST_INTERVAL,
        }
    }

    pub fn lengthen(&mut self, now: Instant) {
        self.pause *= 2;
        self.due = now + self.pause;
    }
}
