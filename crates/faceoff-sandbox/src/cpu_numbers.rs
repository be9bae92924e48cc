//! Numbers of an agent's CPUs: the agent counts from 0, whatever their numbers on the host are.
//!
//! Programs that pin their threads begin with CPU 0, which an agent beside others may not use. So this process answers, in place of the
//! kernel, the system calls that read and change affinities ([`crate::answered_calls`]), and files list the same numbers
//! ([`crate::cpu_view`]).

use crate::{Layer, SpawnSpec, affinity};
use rustix::thread::CpuSet;

/// The CPUs of one agent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CpuNumbers {
    /// Numbers on the host, in ascending order; the agent's number is the index.
    host: Vec<usize>,
    /// Does the agent see its own numbers?
    is_renumbered: bool,
}

impl CpuNumbers {
    /// The CPUs of `spec`: its own, or those of this process. Without the filter that passes calls to this process, they keep their
    /// numbers.
    pub(crate) fn new(spec: &SpawnSpec) -> Self {
        Self::of(&spec.cpus, spec.isolation.enforces(Layer::Seccomp))
    }

    /// `is_filtered`: does the filter pass calls about affinities to this process?
    pub(crate) fn of(cpus: &[usize], is_filtered: bool) -> Self {
        let mut host = match cpus {
            // A host that does not report its CPUs has at least one.
            [] => affinity::process_cpus().unwrap_or_else(|_| vec![0]),
            own => own.to_vec(),
        };
        host.sort_unstable();
        host.dedup();
        let is_renumbered = is_filtered && !host.iter().copied().eq(0..host.len());
        Self {
            host,
            is_renumbered,
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.host.len()
    }

    /// Do the agent's numbers differ from the host's?
    pub(crate) const fn is_renumbered(&self) -> bool {
        self.is_renumbered
    }

    /// The agent's number of the host's CPU `number`; `None` if it is not the agent's.
    pub(crate) fn for_agent(&self, number: usize) -> Option<usize> {
        let index = self.host.iter().position(|&host| host == number)?;
        Some(if self.is_renumbered { index } else { number })
    }

    /// All of the agent's numbers.
    pub(crate) fn all(&self) -> Vec<usize> {
        let all = self.host.iter();
        all.filter_map(|&host| self.for_agent(host)).collect()
    }

    /// The host's CPUs of a mask in the format of `sched_setaffinity`, which starts with the lowest numbers.
    pub(crate) fn host_set(&self, mask: &[u8]) -> CpuSet {
        let mut set = CpuSet::new();
        for &host in &self.host {
            let is_chosen = self.for_agent(host).is_some_and(|own| {
                mask.get(own / 8)
                    .is_some_and(|byte| byte & (1 << (own % 8)) != 0)
            });
            if is_chosen {
                set.set(host);
            }
        }
        set
    }

    /// The mask of the agent's numbers of `set`, in whole words of 8 bytes.
    pub(crate) fn agent_mask(&self, set: &CpuSet) -> Vec<u8> {
        let most = self.all().last().copied().unwrap_or_default();
        let mut mask = vec![0; (most / 64 + 1) * 8];
        for &host in self.host.iter().filter(|&&host| set.is_set(host)) {
            if let Some(own) = self.for_agent(host) {
                mask[own / 8] |= 1 << (own % 8);
            }
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affinity::cpu_set;

    #[test]
    fn agents_cpu_numbers_start_at_0() {
        let numbers = CpuNumbers::of(&[11, 3, 3], true);
        assert!(numbers.is_renumbered());
        assert_eq!(numbers.all(), [0, 1]);
        assert_eq!(numbers.for_agent(11), Some(1));
        assert_eq!(numbers.for_agent(0), None);
        assert_eq!(numbers.host_set(&[0b10]), cpu_set(&[11]));
        assert_eq!(numbers.host_set(&[0b111, 0xff]), cpu_set(&[3, 11]));
        assert_eq!(numbers.host_set(&[]), cpu_set(&[]));
        assert_eq!(
            numbers.agent_mask(&cpu_set(&[2, 11])),
            [0b10, 0, 0, 0, 0, 0, 0, 0]
        );
    }

    #[test]
    fn cpu_numbers_stay_if_they_start_at_0_or_without_filter() {
        assert!(!CpuNumbers::of(&[0, 1], true).is_renumbered());
        let unfiltered = CpuNumbers::of(&[70], false);
        assert!(!unfiltered.is_renumbered());
        assert_eq!(unfiltered.all(), [70]);
        assert_eq!(unfiltered.agent_mask(&cpu_set(&[70])).len(), 16);
        assert_eq!(
            unfiltered.host_set(&[0, 0, 0, 0, 0, 0, 0, 0, 1 << 6]),
            cpu_set(&[70])
        );
    }
}
