//! CPU affinity (the set of CPUs on which a thread may run) and priority of threads. They affect how even the measured times are, not
//! the results.

use rustix::{
    process::{getpriority_process, setpriority_process},
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};
use std::io;

/// The CPUs that the calling thread may use. A container, a service manager or earlier pinning may have
/// removed some.
///
/// # Errors
/// When the kernel does not report them.
pub fn allowed_cpus() -> io::Result<Vec<usize>> {
    Ok(cpu_numbers(&sched_getaffinity(None)?))
}

/// The CPUs that this process may use (those of its main thread), whatever the calling thread is pinned to.
pub(crate) fn process_cpus() -> io::Result<Vec<usize>> {
    Ok(cpu_numbers(&sched_getaffinity(Some(
        rustix::process::getpid(),
    ))?))
}

fn cpu_numbers(set: &CpuSet) -> Vec<usize> {
    (0..CpuSet::MAX_CPU)
        .filter(|cpu| set.is_set(*cpu))
        .collect()
}

/// Pins the calling thread, and the threads that it starts from now on, to these CPUs. An empty list changes
/// nothing.
///
/// # Errors
/// When this process may use none of them.
pub fn pin_current_thread(cpus: &[usize]) -> io::Result<()> {
    if !cpus.is_empty() {
        sched_setaffinity(None, &cpu_set(cpus))?;
    }
    Ok(())
}

/// Gives the calling thread the affinity of the process's main thread, whatever it has inherited. If the host
/// does not allow that, nothing changes.
pub fn reset_to_process() {
    let main_thread = rustix::process::getpid();
    if let Ok(set) = sched_getaffinity(Some(main_thread)) {
        let _ = sched_setaffinity(None, &set);
    }
}

/// Increase of the nice value on CPUs without agents. Beside a simulator that is never idle, the thread gets a third of a CPU. This
/// slows the simulator down, which costs no agent points. With a smaller share, each time slice of a request would wait ten
/// milliseconds or more.
const NICE_BESIDE_SIMULATORS: i32 = 3;
/// Increase of the nice value on CPUs where agents may run. The thread gets a tenth of a CPU, which is enough for a server to answer
/// requests and for a worker to renew the leases of its jobs.
const NICE_BESIDE_AGENTS: i32 = 10;

/// Pins the calling thread, and the threads that it starts from now on, to these CPUs, which no agent uses, and
/// lowers its priority. With an empty list its affinity stays, and its priority is lowered in favour of agents.
/// This cannot be undone.
///
/// # Errors
/// When this process may use none of the CPUs.
pub fn lower_priority(cpus: &[usize]) -> io::Result<()> {
    pin_current_thread(cpus)?;
    let increment = if cpus.is_empty() {
        NICE_BESIDE_AGENTS
    } else {
        NICE_BESIDE_SIMULATORS
    };
    // On Linux a nice value belongs to a thread, not to the process.
    Ok(setpriority_process(None, niceness()? + increment)?)
}

/// The nice value of the calling thread.
///
/// # Errors
/// When the kernel does not report it.
pub fn niceness() -> io::Result<i32> {
    Ok(getpriority_process(None)?)
}

/// Keeps the calling thread off some CPUs until dropped, so that a simulator and its agent do not share one. It
/// cannot be sent to another thread.
#[derive(Debug)]
pub struct AffinityGuard {
    previous_affinity: Option<CpuSet>,
    /// Makes the guard `!Send`: the thread that created it must drop it.
    _this_thread: std::marker::PhantomData<*const ()>,
}

impl AffinityGuard {
    /// Keeps the thread off `cpus`. Does nothing if no other CPU is left, or the host does not allow it: without
    /// pinning, times are less even, and no result is wrong.
    #[must_use]
    pub fn avoid(cpus: &[usize]) -> Self {
        Self {
            previous_affinity: avoid_cpus(cpus),
            _this_thread: std::marker::PhantomData,
        }
    }
}

impl Drop for AffinityGuard {
    fn drop(&mut self) {
        if let Some(previous_affinity) = &self.previous_affinity
            && let Err(error) = sched_setaffinity(None, previous_affinity)
        {
            tracing::warn!(%error, "a thread cannot be unpinned");
        }
    }
}

/// Moves the thread off these CPUs; returns its earlier affinity, if it changed.
fn avoid_cpus(cpus: &[usize]) -> Option<CpuSet> {
    if cpus.is_empty() {
        return None;
    }
    let previous_affinity = sched_getaffinity(None).ok()?;
    let mut remaining = previous_affinity;
    for cpu in representable(cpus) {
        remaining.unset(cpu);
    }
    if remaining.count() == 0 {
        return None;
    }
    match sched_setaffinity(None, &remaining) {
        Ok(()) => Some(previous_affinity),
        Err(error) => {
            tracing::warn!(%error, ?cpus, "a thread cannot be kept off the agent's CPUs");
            None
        }
    }
}

/// The set of these CPU numbers.
pub(crate) fn cpu_set(cpus: &[usize]) -> CpuSet {
    let mut set = CpuSet::new();
    for cpu in representable(cpus) {
        set.set(cpu);
    }
    set
}

/// Drops numbers that a `CpuSet` cannot hold, since they name no CPU.
fn representable(cpus: &[usize]) -> impl Iterator<Item = usize> {
    cpus.iter().copied().filter(|&cpu| cpu < CpuSet::MAX_CPU)
}

/// Sorted CPU numbers, e.g. `0,1,4`, in the format of the cpuset controller of cgroups.
pub(crate) fn cpu_list(cpus: &[usize]) -> String {
    let mut sorted = cpus.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    sorted
        .iter()
        .map(usize::to_string)
        .collect::<Vec<_>>()
        .join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn affinity_guard_restores_the_affinity() {
        let all = allowed_cpus().unwrap();
        let (first, rest) = all.split_first().unwrap();
        {
            let _guard = AffinityGuard::avoid(&[*first]);
            let remaining = allowed_cpus().unwrap();
            // With only one CPU the affinity stays.
            assert_eq!(remaining, if rest.is_empty() { &all[..] } else { rest });
        }
        assert_eq!(allowed_cpus().unwrap(), all);
        pin_current_thread(&[*first, usize::MAX]).unwrap();
        assert_eq!(allowed_cpus().unwrap(), [*first]);
        pin_current_thread(&[]).unwrap();
        assert_eq!(allowed_cpus().unwrap(), [*first]);
        assert!(pin_current_thread(&[usize::MAX]).is_err());
    }
}
