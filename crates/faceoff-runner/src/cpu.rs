use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// Keeps the calling thread off the agent's CPUs for as long as it lives, so that simulator and
/// agent do not share one.
#[derive(Debug)]
pub(crate) struct OffTheAgentsCpus {
    before: Option<CpuSet>,
}

impl OffTheAgentsCpus {
    /// Does nothing where there is no CPU left for the simulator, or the host does not allow it:
    /// pinning makes times fairer, and nothing wrong.
    pub fn pin(agent_cpus: &[usize]) -> Self {
        let nothing = Self { before: None };
        if agent_cpus.is_empty() {
            return nothing;
        }
        let Ok(before) = sched_getaffinity(None) else {
            return nothing;
        };
        let mut rest = before;
        for cpu in agent_cpus.iter().filter(|cpu| **cpu < CpuSet::MAX_CPU) {
            rest.unset(*cpu);
        }
        if rest.count() == 0 {
            return nothing;
        }
        match sched_setaffinity(None, &rest) {
            Ok(()) => Self {
                before: Some(before),
            },
            Err(error) => {
                tracing::warn!(%error, "the simulator's thread cannot be pinned");
                nothing
            }
        }
    }
}

impl Drop for OffTheAgentsCpus {
    fn drop(&mut self) {
        if let Some(before) = &self.before
            && let Err(error) = sched_setaffinity(None, before)
        {
            tracing::warn!(%error, "the simulator's thread cannot be unpinned");
        }
    }
}
