//! One reading of the CPU counters.

use crate::{cpu_counters::Ticks, thread_waits::ThreadWaits};
use std::time::{Duration, Instant};

/// The counters at one time. Only the difference of two readings has a meaning.
#[derive(Debug, Clone)]
pub struct CpuReading {
    pub(super) at: Instant,
    pub(super) agent: Duration,
    /// The same by the clocks of its processes, which do not lag behind but miss processes that have ended; zero in a
    /// baseline.
    pub(super) clocks: Duration,
    /// Run time of all processes on the agent's CPUs; zero if the host counts in ticks only.
    pub(super) all: Duration,
    pub(super) throttled: Duration,
    pub(super) ticks: Vec<Ticks>,
    /// Scheduling counters of the agent's threads, if the kernel has them.
    pub(super) waits: Option<ThreadWaits>,
}

impl CpuReading {
    /// Time since `before` in which none of the agent's threads ran, without the time in which its own quota throttled
    /// it.
    pub(super) fn idle_since(&self, before: &Self) -> Duration {
        self.at
            .saturating_duration_since(before.at)
            .saturating_sub(self.ran_since(before))
            .saturating_sub(self.throttled.saturating_sub(before.throttled))
    }

    /// Run time of the agent since `before`: the maximum of both counters.
    fn ran_since(&self, before: &Self) -> Duration {
        let by_clocks = self.clocks.saturating_sub(before.clocks);
        by_clocks.max(self.agent.saturating_sub(before.agent))
    }
}
