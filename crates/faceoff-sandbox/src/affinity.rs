//! Which CPUs a thread may run on, and who gives way there. It changes how evenly time is kept, never what
//! is computed.

use rustix::{
    process::{getpriority_process, setpriority_process},
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};
use std::io;

/// The CPUs that the calling thread may use: a container, a service manager or a pinning may have
/// taken some away.
///
/// # Errors
/// When the kernel does not tell.
pub fn allowed() -> io::Result<Vec<usize>> {
    Ok(numbers(&sched_getaffinity(None)?))
}

/// The CPUs that this process may use, whatever the calling thread is pinned to: those of its main thread.
pub(crate) fn of_process() -> io::Result<Vec<usize>> {
    Ok(numbers(&sched_getaffinity(
        Some(rustix::process::getpid()),
    )?))
}

fn numbers(set: &CpuSet) -> Vec<usize> {
    (0..CpuSet::MAX_CPU)
        .filter(|cpu| set.is_set(*cpu))
        .collect()
}

/// Keeps the calling thread, and the threads that it starts from now on, on these CPUs; with none
/// given it stays where it is.
///
/// # Errors
/// When none of them is there for this process.
pub fn pin_current_thread(cpus: &[usize]) -> io::Result<()> {
    if !cpus.is_empty() {
        sched_setaffinity(None, &cpu_set(cpus))?;
    }
    Ok(())
}

/// Lets the calling thread run wherever the process's main thread may, whatever it has inherited. Where the host does not
/// allow that it stays where it is.
pub fn as_the_process() {
    let main_thread = rustix::process::getpid();
    if let Ok(set) = sched_getaffinity(Some(main_thread)) {
        let _ = sched_setaffinity(None, &set);
    }
}

/// By how much the nice value is raised of what gives way on CPUs that are no agent's: beside a simulator that is never idle it
/// has a third of a CPU. A simulator's time costs nobody points; with less, whoever looks on waits for ten milliseconds and more
/// at each of a request's turns.
const WAY_GIVEN: i32 = 3;
/// … and where agents may run: a tenth, which keeps a server answering and its leases alive.
const WAY_GIVEN_TO_AGENTS: i32 = 10;

/// Has the calling thread, and the threads that it starts from now on, stay on these CPUs, none of them an agent's, and give way to
/// other threads there; with none given it stays where it is, and gives way to agents. There is no way back.
///
/// # Errors
/// When none of the CPUs is there for this process.
pub fn give_way(cpus: &[usize]) -> io::Result<()> {
    pin_current_thread(cpus)?;
    let given = if cpus.is_empty() {
        WAY_GIVEN_TO_AGENTS
    } else {
        WAY_GIVEN
    };
    // To Linux a priority is a thread's.
    Ok(setpriority_process(None, niceness()? + given)?)
}

/// The nice value of the calling thread.
///
/// # Errors
/// When the kernel does not tell.
pub fn niceness() -> io::Result<i32> {
    Ok(getpriority_process(None)?)
}

/// Keeps the calling thread off some CPUs for as long as this lives, which is not to be sent to
/// another thread: a simulator and its agent do not share one.
#[derive(Debug)]
pub struct PinnedElsewhere {
    before: Option<CpuSet>,
    /// It must be dropped where it was made.
    _this_thread: std::marker::PhantomData<*const ()>,
}

impl PinnedElsewhere {
    /// Does nothing where no other CPU is left, or the host does not allow it: pinning makes times
    /// fairer, and nothing wrong.
    #[must_use]
    pub fn than(cpus: &[usize]) -> Self {
        Self {
            before: leave(cpus),
            _this_thread: std::marker::PhantomData,
        }
    }
}

impl Drop for PinnedElsewhere {
    fn drop(&mut self) {
        if let Some(before) = &self.before
            && let Err(error) = sched_setaffinity(None, before)
        {
            tracing::warn!(%error, "a thread cannot be unpinned");
        }
    }
}

/// What the thread was allowed before it left these CPUs, if it did.
fn leave(cpus: &[usize]) -> Option<CpuSet> {
    if cpus.is_empty() {
        return None;
    }
    let before = sched_getaffinity(None).ok()?;
    let mut rest = before;
    for cpu in within_the_interface(cpus) {
        rest.unset(cpu);
    }
    if rest.count() == 0 {
        return None;
    }
    match sched_setaffinity(None, &rest) {
        Ok(()) => Some(before),
        Err(error) => {
            tracing::warn!(%error, ?cpus, "a thread cannot be kept off the agent's CPUs");
            None
        }
    }
}

/// The set of these CPU numbers.
pub(crate) fn cpu_set(cpus: &[usize]) -> CpuSet {
    let mut set = CpuSet::new();
    for cpu in within_the_interface(cpus) {
        set.set(cpu);
    }
    set
}

/// Numbers beyond what the kernel's interface holds name no CPU.
fn within_the_interface(cpus: &[usize]) -> impl Iterator<Item = usize> {
    cpus.iter().copied().filter(|&cpu| cpu < CpuSet::MAX_CPU)
}

/// `0-1,4` for the cpuset controller.
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
    fn a_thread_leaves_and_returns() {
        let all = allowed().unwrap();
        let (first, rest) = all.split_first().unwrap();
        {
            let _elsewhere = PinnedElsewhere::than(&[*first]);
            let left = allowed().unwrap();
            // where there is but one CPU, it stays
            assert_eq!(left, if rest.is_empty() { &all[..] } else { rest });
        }
        assert_eq!(allowed().unwrap(), all);
        pin_current_thread(&[*first, usize::MAX]).unwrap();
        assert_eq!(allowed().unwrap(), [*first]);
        pin_current_thread(&[]).unwrap();
        assert_eq!(allowed().unwrap(), [*first]);
        assert!(pin_current_thread(&[usize::MAX]).is_err());
    }
}
