//! CPU time by the clocks of processes and threads. That of a process tree is used without a cgroup, and where the cgroup's counter lags
//! behind.

use rustix::{
    process::Pid,
    time::{ClockId, clock_gettime},
};
use std::{cell::RefCell, collections::BTreeMap, fs, time::Duration};

/// CPU time of every process ever seen in a tree, in nanoseconds. It misses the time that a process used after
/// its last reading, and processes that started and ended between two readings.
#[derive(Debug)]
pub(crate) struct TreeClock {
    /// The process at the top of the tree.
    root: Pid,
    time_ns_by_pid: RefCell<BTreeMap<i32, u64>>,
}

impl TreeClock {
    pub(crate) const fn new(root: Pid) -> Self {
        Self {
            root,
            time_ns_by_pid: RefCell::new(BTreeMap::new()),
        }
    }

    /// CPU time so far, in seconds; `None` if the host does not report it.
    pub(crate) fn cpu_time_s(&self) -> Option<f64> {
        let mut time_ns_by_pid = self.time_ns_by_pid.borrow_mut();
        let mut pending_pids = vec![self.root.as_raw_nonzero().get()];
        while let Some(pid) = pending_pids.pop() {
            if let Some(now) = process_clock_ns(pid) {
                let recorded = time_ns_by_pid.entry(pid).or_default();
                *recorded = now.max(*recorded);
            }
            pending_pids.extend(children(pid));
        }
        let sum: u64 = time_ns_by_pid.values().sum();
        (!time_ns_by_pid.is_empty()).then_some(sum as f64 * 1e-9)
    }
}

/// Total CPU time of those of the processes that are alive, including their current time slices.
pub(crate) fn total_run_time(processes: &[Pid]) -> Duration {
    let each = processes
        .iter()
        .filter_map(|process| process_clock_ns(process.as_raw_nonzero().get()));
    Duration::from_nanos(each.sum())
}

/// The children of all threads of a process; none if the kernel does not list them.
fn children(pid: i32) -> Vec<i32> {
    let threads = fs::read_dir(format!("/proc/{pid}/task"))
        .into_iter()
        .flatten();
    threads
        .flatten()
        .filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok())
        .flat_map(|list| {
            list.split_whitespace()
                .filter_map(|pid| pid.parse().ok())
                .collect::<Vec<i32>>()
        })
        .collect()
}

/// CPU time of all threads of a process.
fn process_clock_ns(pid: i32) -> Option<u64> {
    let mut clock: libc::clockid_t = 0;
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    #[expect(unsafe_code, reason = "rustix knows only the caller's own clocks")]
    // SAFETY: both calls write to the variable whose address they are given, and to nothing else.
    let is_read = unsafe {
        libc::clock_getcpuclockid(pid, &raw mut clock) == 0
            && libc::clock_gettime(clock, &raw mut time) == 0
    };
    let seconds = u64::try_from(time.tv_sec).ok()?;
    let nanoseconds = u64::try_from(time.tv_nsec).ok()?;
    is_read.then_some(seconds * 1_000_000_000 + nanoseconds)
}

/// CPU time of the calling thread.
pub(crate) fn own_cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    Duration::new(seconds, u32::try_from(time.tv_nsec).unwrap_or(0))
}
