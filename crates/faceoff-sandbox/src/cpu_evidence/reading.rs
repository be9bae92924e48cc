//! One reading of the counters.

use crate::{cpu_counters::Ticks, cpu_waits::Waits};
use std::time::{Duration, Instant};

/// The counters at one time. Only the difference of two says something.
#[derive(Debug, Clone)]
pub struct CpuReading {
    pub(super) at: Instant,
    pub(super) agent: Duration,
    /// The same by the clocks of its processes, which do not lag behind but miss those that ended; zero at a
    /// glance.
    pub(super) clocks: Duration,
    /// Run time of everything on the agent's CPUs; zero where only ticks tell.
    pub(super) all: Duration,
    pub(super) throttled: Duration,
    pub(super) ticks: Vec<Ticks>,
    /// Of the agent's threads, where the kernel tells.
    pub(super) waits: Option<Waits>,
}

impl CpuReading {
    /// For how long since `before` the agent could have run and did not: none of its threads ran, and its own quota did
    /// not hold it up.
    pub(super) fn idle_since(&self, before: &Self) -> Duration {
        self.at
            .saturating_duration_since(before.at)
            .saturating_sub(self.ran_since(before))
            .saturating_sub(self.throttled.saturating_sub(before.throttled))
    }

    /// What the agent ran, the most that either count tells.
    fn ran_since(&self, before: &Self) -> Duration {
        let by_clocks = self.clocks.saturating_sub(before.clocks);
        by_clocks.max(self.agent.saturating_sub(before.agent))
    }
}
