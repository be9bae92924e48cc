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

    /// Those of both sides of a game. What a slot has for one agent is halved, so that three CPUs keep the simulator
    /// and both sides apart. Where there is one for both, they share it with the simulator, and it the simulator's with
    /// them: what the others took of an answer is told apart as anywhere.
    #[must_use]
    pub fn of_a_game(&self) -> [Vec<usize>; 2] {
        match &self.agents[..] {
            [first, second, ..] => [first.clone(), second.clone()],
            [both] if both.len() > 1 => {
                let (first, second) = both.split_at(both.len() / 2);
                // As many each, so that neither is favoured.
                [first.to_vec(), second[..first.len()].to_vec()]
            }
            _ => {
                let mut shared: Vec<usize> = self.simulator.clone();
                shared.extend(self.agents.iter().flatten());
                shared.sort_unstable();
                shared.dedup();
                [shared.clone(), shared]
            }
        }
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
    /// Where the rest of a server runs: requests, database, schedule. Empty = anywhere.
    pub service: Vec<usize>,
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
                service: Vec::new(),
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
            service: Vec::new(),
        }
    }

    /// [`Self::divide`] beside a server that answers strangers. Where slots leave a CPU over, a quarter of
    /// all CPUs, but at least one, is the server's alone, the first ones, which take most devices'
    /// interrupts; where they leave none it shares the simulators', and never an agent's.
    #[must_use]
    pub fn beside_a_service(cpus: &[usize], slots: usize, agents: usize) -> Self {
        let left_over = cpus.len().saturating_sub(slots * (1 + agents));
        let (service, rest) = cpus.split_at(left_over.min((cpus.len() / 4).max(1)));
        let mut layout = Self::divide(rest, slots, agents);
        if !layout.shared {
            layout.service = match service {
                [] => layout.simulators(),
                own => own.to_vec(),
            };
        }
        layout
    }

    /// All agents on `agents`, one slot at a time or not, as the organiser wants it. Of the other CPUs
    /// each simulator has one and the server the rest; where they are too few, all of these share them.
    #[must_use]
    pub fn with_agents_on(agents: &[usize], cpus: &[usize], slots: usize) -> Self {
        let others: Vec<usize> = cpus
            .iter()
            .copied()
            .filter(|cpu| !agents.contains(cpu))
            .collect();
        let (simulators, service) = if others.len() > slots {
            let (service, simulators) = others.split_at(others.len() - slots);
            (simulators.iter().map(|cpu| vec![*cpu]).collect(), service)
        } else {
            (vec![Vec::new(); slots], &others[..])
        };
        let slot = |simulator| SlotCpus {
            simulator,
            agents: vec![agents.to_vec()],
        };
        Self {
            slots: simulators.into_iter().map(slot).collect(),
            shared: slots > 1,
            service: service.to_vec(),
        }
    }

    /// The layout of a server on this host, for `slots` slots of one agent each; `agent_cpus` as the
    /// organiser has set them, empty if not. To be asked before a thread is pinned.
    #[must_use]
    pub fn of_a_server(slots: usize, agent_cpus: &[usize]) -> Self {
        let cpus = affinity::allowed().unwrap_or_else(|error| {
            tracing::warn!(%error, "cannot ask for this process's CPUs; nothing is pinned");
            Vec::new()
        });
        if !agent_cpus.is_empty() {
            return Self::with_agents_on(agent_cpus, &cpus, slots);
        }
        let layout = Self::beside_a_service(&cpus, slots, 1);
        if layout.shared {
            tracing::warn!(
                slots,
                "fewer than two CPUs per slot: agents share theirs, and computation times are uneven"
            );
        }
        layout
    }

    fn simulators(&self) -> Vec<usize> {
        let each = self.slots.iter().flat_map(|slot| &slot.simulator);
        each.copied().collect()
    }
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
                shared: false,
                service: Vec::new(),
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
    fn the_sides_of_a_game_have_halves_of_a_slots_cpus_or_share_them_all() {
        let of_a_game = |simulator: &[usize], agents: &[&[usize]]| {
            let [first, second] = slot(simulator, agents).of_a_game();
            (first, second)
        };
        let (none, one) = (Vec::new(), vec![1]);
        assert_eq!(of_a_game(&[0], &[&[1, 2]]), (one.clone(), vec![2]));
        assert_eq!(
            of_a_game(&[0], &[&[1, 2, 3, 4, 5]]),
            (vec![1, 2], vec![3, 4])
        );
        assert_eq!(of_a_game(&[0], &[&[1], &[2]]), (one, vec![2]));
        assert_eq!(of_a_game(&[1], &[&[0]]), (vec![0, 1], vec![0, 1]));
        assert_eq!(of_a_game(&[], &[&[3]]), (vec![3], vec![3]));
        assert_eq!(of_a_game(&[], &[&[]]), (none.clone(), none));
        // As docs/operating.md advises.
        for cpus in 7..=16 {
            let layout = CpuLayout::beside_a_service(&first(cpus), 2, 1);
            for slot in &layout.slots {
                let [first, second] = slot.of_a_game();
                assert!(!first.is_empty() && !second.is_empty(), "{cpus}");
                assert!(first.iter().all(|cpu| !second.contains(cpu)), "{cpus}");
                assert!(!first.contains(&slot.simulator[0]), "{cpus}");
            }
        }
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
                    shared: true,
                    service: Vec::new(),
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
    fn a_server_has_cpus_of_its_own_where_slots_leave_one_and_never_an_agents() {
        for (cpus, slots, service) in [
            (1, 1, &[][..]),
            (2, 1, &[0]),
            (3, 1, &[0]),
            (4, 1, &[0]),
            (4, 2, &[0, 2]),
            (8, 1, &[0, 1]),
            (8, 3, &[0, 1]),
            (9, 4, &[0]),
        ] {
            let layout = CpuLayout::beside_a_service(&first(cpus), slots, 1);
            assert_eq!(layout.service, service, "{cpus} CPUs, {slots} slots");
            assert_eq!(layout.slots.len(), slots);
            let agents: Vec<_> = layout.slots.iter().flat_map(|s| &s.agents[0]).collect();
            assert!(!service.iter().any(|cpu| agents.contains(&cpu)));
            if cpus > 2 * slots {
                let simulators = layout.simulators();
                assert!(!service.iter().any(|cpu| simulators.contains(cpu)));
            }
        }
    }

    #[test]
    fn agents_where_the_organiser_wants_them_leave_the_rest_to_the_others() {
        let layout = |agents: &[usize], cpus, slots| {
            let layout = CpuLayout::with_agents_on(agents, &first(cpus), slots);
            (layout.simulators(), layout.service)
        };
        assert_eq!(layout(&[1], 2, 1), (vec![], vec![0]));
        assert_eq!(layout(&[3], 4, 1), (vec![2], vec![0, 1]));
        assert_eq!(layout(&[2, 3], 4, 2), (vec![], vec![0, 1]));
        assert_eq!(layout(&[0], 1, 1), (vec![], vec![]), "it has no other");
    }

    #[test]
    fn gaps_in_the_allowed_cpus_are_respected() {
        let layout = CpuLayout::divide(&[3, 5, 8, 9], 2, 1);
        assert_eq!(layout.slots, [slot(&[3], &[&[5]]), slot(&[8], &[&[9]])]);
    }
}
