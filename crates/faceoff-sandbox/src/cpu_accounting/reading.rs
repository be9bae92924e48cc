//! One reading of the kernel's counters of an agent's CPUs and threads.

use crate::{cpu_counters::Ticks, thread_waits::ThreadWaits};
use std::time::{Duration, Instant};

/// The counters at one time. Only the difference of two readings has a meaning.
#[derive(Debug, Clone)]
pub struct CpuReading {
    pub(super) read_at: Instant,
    /// Run time of the agent, by its cgroup.
    pub(super) agent_run_time: Duration,
    /// Run time of the agent, by the clocks of its processes. They do not lag behind, but miss processes that have ended. Zero in
    /// a [`CounterBaseline`](super::CounterBaseline), whose reading must take only a few microseconds.
    pub(super) agent_clock_time: Duration,
    /// Run time of all processes on the agent's CPUs; zero if the host counts in ticks only.
    pub(super) total_run_time: Duration,
    /// Time in which the agent's own CPU quota throttled it.
    pub(super) throttled: Duration,
    /// Counters of each of the agent's CPUs, in ticks of 10 ms.
    pub(super) ticks: Vec<Ticks>,
    /// Scheduling counters of the agent's threads, if the kernel has them.
    pub(super) waits: Option<ThreadWaits>,
}

impl CpuReading {
    /// Time since `earlier` in which none of the agent's threads ran, without the time in which its own quota throttled
    /// it.
    pub(super) fn idle_since(&self, earlier: &Self) -> Duration {
        self.read_at
            .saturating_duration_since(earlier.read_at)
            .saturating_sub(self.ran_since(earlier))
            .saturating_sub(self.throttled.saturating_sub(earlier.throttled))
    }

    /// Run time of the agent since `earlier`: the maximum of both counters.
    fn ran_since(&self, earlier: &Self) -> Duration {
        let by_clocks = self
            .agent_clock_time
            .saturating_sub(earlier.agent_clock_time);
        by_clocks.max(self.agent_run_time.saturating_sub(earlier.agent_run_time))
    }
}
