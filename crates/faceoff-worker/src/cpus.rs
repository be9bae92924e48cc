//! Division of the host's CPUs among the slots of a worker (each runs one job at a time), their agents and the server.

use faceoff_sandbox::affinity;

/// The CPUs of one slot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlotCpus {
    /// CPUs that the simulator's thread is pinned to; empty: not pinned.
    pub simulator: Vec<usize>,
    /// CPUs of each agent that runs at the same time; empty: any CPU.
    pub agents: Vec<Vec<usize>>,
}

impl SlotCpus {
    /// The CPUs of one agent, counted from 0.
    #[must_use]
    pub fn agent_cpus(&self, agent: usize) -> &[usize] {
        self.agents.get(agent).map_or(&[], Vec::as_slice)
    }

    /// The CPUs of both sides of a game. The agent CPUs of a slot are halved, so three CPUs separate the simulator and
    /// both sides. With only one agent CPU, the sides and the simulator share all CPUs of the slot. Then,
    /// too, the time for which something other than the agent ran on its CPUs is measured for late answers: as *host
    /// interference*, which is no part of the computation time.
    #[must_use]
    pub fn side_cpus(&self) -> [Vec<usize>; 2] {
        match &self.agents[..] {
            [first, second, ..] => [first.clone(), second.clone()],
            [both] if both.len() > 1 => {
                let (first, second) = both.split_at(both.len() / 2);
                // The same number for each side, so that neither has an advantage.
                [first.to_vec(), second[..first.len()].to_vec()]
            }
            _ => {
                let mut all_of_slot: Vec<usize> = self.simulator.clone();
                all_of_slot.extend(self.agents.iter().flatten());
                all_of_slot.sort_unstable();
                all_of_slot.dedup();
                [all_of_slot.clone(), all_of_slot]
            }
        }
    }
}

/// The CPUs of all slots. Agents are timed, so if there are enough CPUs, an agent shares its own with neither the
/// simulator nor its opponent nor another slot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuLayout {
    /// One entry per slot.
    pub slots: Vec<SlotCpus>,
    /// Do agents share CPUs with each other or with the simulators because there are too few?
    pub agents_share_cpus: bool,
    /// CPUs for the rest of the server: requests, database, schedule. Empty: any CPU.
    pub server: Vec<usize>,
}

impl CpuLayout {
    /// Divides the CPUs among `slots` slots with `agents` agents each. The first CPU of each slot's equal share is for
    /// the simulator; the others are for the agents, in equal parts. If that leaves an agent without a CPU, nothing is
    /// pinned, and the operating system balances the load.
    #[must_use]
    pub fn divide(cpus: &[usize], slots: usize, agents: usize) -> Self {
        let share = cpus.len().checked_div(slots).unwrap_or(0);
        let per_agent = share.saturating_sub(1).checked_div(agents).unwrap_or(0);
        if per_agent == 0 {
            let unpinned = SlotCpus {
                simulator: Vec::new(),
                agents: vec![Vec::new(); agents],
            };
            return Self {
                slots: vec![unpinned; slots],
                agents_share_cpus: true,
                server: Vec::new(),
            };
        }
        let slots = cpus
            .chunks_exact(share)
            .take(slots)
            .map(|cpus| SlotCpus {
                simulator: vec![cpus[0]],
                agents: cpus[1..]
                    .chunks_exact(per_agent)
                    .take(agents)
                    .map(<[usize]>::to_vec)
                    .collect(),
            })
            .collect();
        Self {
            slots,
            agents_share_cpus: false,
            server: Vec::new(),
        }
    }

    /// [`Self::divide`] for a host that also runs a server. If slots leave CPUs over, up to a quarter of all CPUs, but at
    /// least one, is reserved for the server: the first ones, which handle most device interrupts. Otherwise the server
    /// shares the simulators' CPUs, never an agent's.
    #[must_use]
    pub fn with_server(cpus: &[usize], slots: usize, agents: usize) -> Self {
        let left_over = cpus.len().saturating_sub(slots * (1 + agents));
        let (server_cpus, rest) = cpus.split_at(left_over.min((cpus.len() / 4).max(1)));
        let mut layout = Self::divide(rest, slots, agents);
        if !layout.agents_share_cpus {
            layout.server = match server_cpus {
                [] => layout.simulator_cpus(),
                reserved => reserved.to_vec(),
            };
        }
        layout
    }

    /// All agents on the CPUs `agents`, as configured by the organiser. Each simulator has one of the other CPUs and
    /// the server the rest. If they are too few, no simulator is pinned, and the server has all of them.
    #[must_use]
    pub fn with_agents_on(agents: &[usize], cpus: &[usize], slots: usize) -> Self {
        let not_for_agents: Vec<usize> = cpus
            .iter()
            .copied()
            .filter(|cpu| !agents.contains(cpu))
            .collect();
        let (simulators, server_cpus) = if not_for_agents.len() > slots {
            let (server_cpus, simulators) = not_for_agents.split_at(not_for_agents.len() - slots);
            (
                simulators.iter().map(|cpu| vec![*cpu]).collect(),
                server_cpus,
            )
        } else {
            (vec![Vec::new(); slots], &not_for_agents[..])
        };
        let slot = |simulator| SlotCpus {
            simulator,
            agents: vec![agents.to_vec()],
        };
        Self {
            slots: simulators.into_iter().map(slot).collect(),
            agents_share_cpus: slots > 1,
            server: server_cpus.to_vec(),
        }
    }

    /// The layout of a server on this host, for `slots` slots of one agent each. `agent_cpus` are those configured by
    /// the organiser, if any. Call this before any thread is pinned.
    #[must_use]
    pub fn for_server(slots: usize, agent_cpus: &[usize]) -> Self {
        let cpus = affinity::allowed_cpus().unwrap_or_else(|error| {
            tracing::warn!(%error, "cannot read this process's CPUs; nothing is pinned");
            Vec::new()
        });
        if !agent_cpus.is_empty() {
            return Self::with_agents_on(agent_cpus, &cpus, slots);
        }
        let layout = Self::with_server(&cpus, slots, 1);
        if layout.agents_share_cpus {
            tracing::warn!(
                slots,
                "fewer than two CPUs per slot: agents share CPUs, and computation times are uneven"
            );
        }
        layout
    }

    fn simulator_cpus(&self) -> Vec<usize> {
        let cpus = self.slots.iter().flat_map(|slot| &slot.simulator);
        cpus.copied().collect()
    }
}

/// Pins the calling thread to these CPUs. On a failure timings vary more, but results are the same.
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

    /// The CPUs from 0 on.
    fn first_cpus(count: usize) -> Vec<usize> {
        (0..count).collect()
    }

    #[test]
    fn two_cpus_separate_simulator_and_agent() {
        let layout = CpuLayout::divide(&first_cpus(2), 1, 1);
        let slots = vec![slot(&[0], &[&[1]])];
        assert_eq!(
            layout,
            CpuLayout {
                slots,
                agents_share_cpus: false,
                server: Vec::new(),
            }
        );
    }

    #[test]
    fn opponents_have_equally_many_cpus() {
        let layout = CpuLayout::divide(&first_cpus(6), 1, 2);
        assert_eq!(layout.slots, [slot(&[0], &[&[1, 2], &[3, 4]])]);
        assert_eq!(layout.slots[0].agent_cpus(1), [3, 4]);
    }

    #[test]
    fn sides_split_a_slots_cpus_or_share_them() {
        let side_cpus = |simulator: &[usize], agents: &[&[usize]]| {
            let [first, second] = slot(simulator, agents).side_cpus();
            (first, second)
        };
        let (none, one) = (Vec::new(), vec![1]);
        assert_eq!(side_cpus(&[0], &[&[1, 2]]), (one.clone(), vec![2]));
        assert_eq!(
            side_cpus(&[0], &[&[1, 2, 3, 4, 5]]),
            (vec![1, 2], vec![3, 4])
        );
        assert_eq!(side_cpus(&[0], &[&[1], &[2]]), (one, vec![2]));
        assert_eq!(side_cpus(&[1], &[&[0]]), (vec![0, 1], vec![0, 1]));
        assert_eq!(side_cpus(&[], &[&[3]]), (vec![3], vec![3]));
        assert_eq!(side_cpus(&[], &[&[]]), (none.clone(), none));
        // As recommended in docs/monitoring.md.
        for cpus in 7..=16 {
            let layout = CpuLayout::with_server(&first_cpus(cpus), 2, 1);
            for slot in &layout.slots {
                let [first, second] = slot.side_cpus();
                assert!(!first.is_empty() && !second.is_empty(), "{cpus}");
                assert!(first.iter().all(|cpu| !second.contains(cpu)), "{cpus}");
                assert!(!first.contains(&slot.simulator[0]), "{cpus}");
            }
        }
    }

    #[test]
    fn too_few_cpus_are_shared_unpinned() {
        for (cpus, slots, agents) in [(1, 1, 1), (2, 2, 1), (3, 2, 1), (0, 1, 1), (2, 1, 2)] {
            let layout = CpuLayout::divide(&first_cpus(cpus), slots, agents);
            let unpinned = slot(&[], &vec![&[][..]; agents]);
            let slots = vec![unpinned; slots];
            assert_eq!(
                layout,
                CpuLayout {
                    slots,
                    agents_share_cpus: true,
                    server: Vec::new(),
                }
            );
        }
    }

    #[test]
    fn cpus_are_not_assigned_twice() {
        for cpus in 2..20 {
            for (slots, agents) in (1..=cpus / 2).flat_map(|slots| [(slots, 1), (slots, 2)]) {
                let layout = CpuLayout::divide(&first_cpus(cpus), slots, agents);
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
    fn server_never_shares_an_agents_cpus() {
        for (cpus, slots, server_cpus) in [
            (1, 1, &[][..]),
            (2, 1, &[0]),
            (3, 1, &[0]),
            (4, 1, &[0]),
            (4, 2, &[0, 2]),
            (8, 1, &[0, 1]),
            (8, 3, &[0, 1]),
            (9, 4, &[0]),
        ] {
            let layout = CpuLayout::with_server(&first_cpus(cpus), slots, 1);
            assert_eq!(layout.server, server_cpus, "{cpus} CPUs, {slots} slots");
            assert_eq!(layout.slots.len(), slots);
            let agents: Vec<_> = layout.slots.iter().flat_map(|s| &s.agents[0]).collect();
            assert!(!server_cpus.iter().any(|cpu| agents.contains(&cpu)));
            if cpus > 2 * slots {
                let simulators = layout.simulator_cpus();
                assert!(!server_cpus.iter().any(|cpu| simulators.contains(cpu)));
            }
        }
    }

    #[test]
    fn configured_agent_cpus_leave_the_rest_to_others() {
        let layout = |agents: &[usize], cpus, slots| {
            let layout = CpuLayout::with_agents_on(agents, &first_cpus(cpus), slots);
            (layout.simulator_cpus(), layout.server)
        };
        assert_eq!(layout(&[1], 2, 1), (vec![], vec![0]));
        assert_eq!(layout(&[3], 4, 1), (vec![2], vec![0, 1]));
        assert_eq!(layout(&[2, 3], 4, 2), (vec![], vec![0, 1]));
        assert_eq!(
            layout(&[0], 1, 1),
            (vec![], vec![]),
            "there is no other CPU"
        );
    }

    #[test]
    fn gaps_in_the_allowed_cpus_are_respected() {
        let layout = CpuLayout::divide(&[3, 5, 8, 9], 2, 1);
        assert_eq!(layout.slots, [slot(&[3], &[&[5]]), slot(&[8], &[&[9]])]);
    }
}
