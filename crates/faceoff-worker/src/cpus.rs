use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// The CPUs of one slot.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SlotCpus {
    /// Where the simulator's thread is pinned; empty = not pinned.
    pub simulator: Vec<usize>,
    /// Where the agent may run; empty = anywhere.
    pub agent: Vec<usize>,
}

/// Which slot runs where. An agent is timed, so it shares its CPUs with neither its simulator nor
/// another slot, where there are enough.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuLayout {
    /// One per slot.
    pub slots: Vec<SlotCpus>,
    /// Does an agent share its CPUs, because there are fewer than two per slot?
    pub shared: bool,
}

impl CpuLayout {
    /// Divides CPUs 0 to `n_cpus` − 1 among `slots` slots.
    #[must_use]
    pub fn for_slots(n_cpus: usize, slots: usize) -> Self {
        let cpus: Vec<usize> = (0..n_cpus).collect();
        Self::divide(&cpus, slots)
    }

    /// Divides these CPUs among `slots` slots: of each slot's equal share the first is the
    /// simulator's and the others are the agent's. With fewer than two per slot nothing is pinned,
    /// and the operating system balances.
    #[must_use]
    pub fn divide(cpus: &[usize], slots: usize) -> Self {
        let share = cpus.len().checked_div(slots).unwrap_or(0);
        if share < 2 {
            return Self {
                slots: vec![SlotCpus::default(); slots],
                shared: true,
            };
        }
        let slots = cpus
            .chunks_exact(share)
            .take(slots)
            .map(|cpus| SlotCpus {
                simulator: vec![cpus[0]],
                agent: cpus[1..].to_vec(),
            })
            .collect();
        Self {
            slots,
            shared: false,
        }
    }
}

/// The CPUs that this process may use: a container or a service manager may have taken some away.
pub(crate) fn allowed() -> Vec<usize> {
    match sched_getaffinity(None) {
        Ok(set) => (0..CpuSet::MAX_CPU)
            .filter(|cpu| set.is_set(*cpu))
            .collect(),
        Err(error) => {
            tracing::warn!(%error, "cannot ask for this process's CPUs; nothing is pinned");
            Vec::new()
        }
    }
}

/// Pins the calling thread. Timings are less even without it, results are the same.
pub(crate) fn pin_this_thread(cpus: &[usize]) {
    if cpus.is_empty() {
        return;
    }
    let mut set = CpuSet::new();
    for cpu in cpus {
        set.set(*cpu);
    }
    if let Err(error) = sched_setaffinity(None, &set) {
        tracing::warn!(%error, ?cpus, "cannot pin the simulator's thread");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(simulator: &[usize], agent: &[usize]) -> SlotCpus {
        SlotCpus {
            simulator: simulator.to_vec(),
            agent: agent.to_vec(),
        }
    }

    #[test]
    fn two_cpus_one_slot_separates_simulator_and_agent() {
        let layout = CpuLayout::for_slots(2, 1);
        assert_eq!(
            layout,
            CpuLayout {
                slots: vec![slot(&[0], &[1])],
                shared: false
            }
        );
    }

    #[test]
    fn too_few_cpus_are_shared_unpinned() {
        for (cpus, slots) in [(1, 1), (2, 2), (3, 2), (0, 1)] {
            let layout = CpuLayout::for_slots(cpus, slots);
            assert_eq!(
                layout,
                CpuLayout {
                    slots: vec![slot(&[], &[]); slots],
                    shared: true
                }
            );
        }
    }

    #[test]
    fn no_cpu_belongs_to_two_slots() {
        for cpus in 2..20 {
            for slots in 1..=cpus / 2 {
                let layout = CpuLayout::for_slots(cpus, slots);
                assert_eq!(layout.slots.len(), slots);
                let mut used: Vec<usize> = layout
                    .slots
                    .iter()
                    .flat_map(|s| s.simulator.iter().chain(&s.agent))
                    .copied()
                    .collect();
                let count = used.len();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), count, "{cpus} CPUs, {slots} slots: {layout:?}");
            }
        }
    }

    #[test]
    fn gaps_in_the_allowed_cpus_are_respected() {
        let layout = CpuLayout::divide(&[3, 5, 8, 9], 2);
        assert_eq!(layout.slots, vec![slot(&[3], &[5]), slot(&[8], &[9])]);
    }
}
