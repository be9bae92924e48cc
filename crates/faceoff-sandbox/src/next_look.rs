use std::time::{Duration, Instant};

/// When to look for the first time; then ever more rarely.
const FIRST_LOOK: Duration = Duration::from_millis(100);

/// When to look again whether an agent that says nothing has closed its output.
#[derive(Debug)]
pub(crate) struct NextLook {
    pub at: Instant,
    pause: Duration,
}

impl NextLook {
    /// After the agent was asked.
    pub fn first(now: Instant) -> Self {
        Self {
            at: now + FIRST_LOOK,
            pause: FIRST_LOOK,
        }
    }

    pub fn after_a_longer_pause(&mut self, now: Instant) {
        self.pause *= 2;
        self.at = now + self.pause;
    }
}
