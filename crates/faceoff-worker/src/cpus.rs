use faceoff_sandbox::affinity;

/// The CPUs of one slot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlotCpus {
    /// Where the simulator's thread is pinned; empty = not pinned.
    pub simulator: Vec<usize>,
    /// Where each of the agents that play at a time may run; empty = anywhere.
    pub agents: Vec<Vec<usize>>,
}

impl SlotCpus {
    /// Those of one agent, counted from 0.
    #[must_use]
    pub fn of_agent(&self, agent: usize) -> &[usize] {
        self.agents.get(agent).map_or(&[], Vec::as_slice)
    }
}

/// Which slot runs where. An agent is timed, so it shares its CPUs with neither its simulator nor
/// its opponent nor another slot, where there are enough.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuLayout {
    /// One per slot.
    pub slots: Vec<SlotCpus>,
    /// Does an agent share its CPUs, because there are too few?
    pub shared: bool,
}

impl CpuLayout {
    /// Divides these CPUs among `slots` slots with so many `agents` each: of each slot's equal share
    /// the first is the simulator's, and the others are the agents', in equal parts. Where that leaves
    /// an agent without, nothing is pinned, and the operating system balances.
    #[must_use]
    pub fn divide(cpus: &[usize], slots: usize, agents: usize) -> Self {
        let share = cpus.len().checked_div(slots).unwrap_or(0);
        let of_each_agent = share.saturating_sub(1).checked_div(agents).unwrap_or(0);
        if of_each_agent == 0 {
            let unpinned = SlotCpus {
                simulator: Vec::new(),
                agents: vec![Vec::new(); agents],
            };
            return Self {
                slots: vec![unpinned; slots],
                shared: true,
            };
        }
        let slots = cpus
            .chunks_exact(share)
            .take(slots)
            .map(|cpus| SlotCpus {
                simulator: vec![cpus[0]],
                agents: cpus[1..]
                    .chunks_exact(of_each_agent)
                    .take(agents)
                    .map(<[usize]>::to_vec)
                    .collect(),
            })
            .collect();
        Self {
            slots,
            shared: false,
        }
    }
}

/// The CPUs that this process may use.
pub(crate) fn allowed() -> Vec<usize> {
    affinity::allowed().unwrap_or_else(|error| {
        tracing::warn!(%error, "cannot ask for this process's CPUs; nothing is pinned");
        Vec::new()
    })
}

/// Pins the calling thread. Timings are less even without it, results are the same.
pub(crate) fn pin_simulator(cpus: &[usize]) {
    if let Err(error) = affinity::pin_current_thread(cpus) {
        tracing::warn!(%error, ?cpus, "cannot pin the simulator's thread");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(simulator: &[usize], agents: &[&[usize]]) -> SlotCpus {
        SlotCpus {
            simulator: simulator.to_vec(),
            agents: agents.iter().map(|cpus| cpus.to_vec()).collect(),
        }
    }

    fn first(cpus: usize) -> Vec<usize> {
        (0..cpus).collect()
    }

    #[test]
    fn two_cpus_one_slot_separates_simulator_and_agent() {
        let layout = CpuLayout::divide(&first(2), 1, 1);
        let slots = vec![slot(&[0], &[&[1]])];
        assert_eq!(
            layout,
            CpuLayout {
                slots,
                shared: false
            }
        );
    }

    #[test]
    fn opponents_have_as_many_cpus_each() {
        let layout = CpuLayout::divide(&first(6), 1, 2);
        assert_eq!(layout.slots, [slot(&[0], &[&[1, 2], &[3, 4]])]);
        assert_eq!(layout.slots[0].of_agent(1), [3, 4]);
    }

    #[test]
    fn too_few_cpus_are_shared_unpinned() {
        for (cpus, slots, agents) in [(1, 1, 1), (2, 2, 1), (3, 2, 1), (0, 1, 1), (2, 1, 2)] {
            let layout = CpuLayout::divide(&first(cpus), slots, agents);
            let unpinned = slot(&[], &vec![&[][..]; agents]);
            let slots = vec![unpinned; slots];
            assert_eq!(
                layout,
                CpuLayout {
                    slots,
                    shared: true
                }
            );
        }
    }

    #[test]
    fn no_cpu_belongs_to_two() {
        for cpus in 2..20 {
            for (slots, agents) in (1..=cpus / 2).flat_map(|slots| [(slots, 1), (slots, 2)]) {
                let layout = CpuLayout::divide(&first(cpus), slots, agents);
                assert_eq!(layout.slots.len(), slots);
                let mut used: Vec<usize> = layout
                    .slots
                    .iter()
                    .flat_map(|s| s.simulator.iter().chain(s.agents.iter().flatten()))
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
        let layout = CpuLayout::divide(&[3, 5, 8, 9], 2, 1);
        assert_eq!(layout.slots, [slot(&[3], &[&[5]]), slot(&[8], &[&[9]])]);
    }
}
