//! The kernel's scheduling counters of a thread: how long it ran, and how long it waited for a CPU.

use std::{fs::File, os::unix::fs::FileExt, time::Duration};

/// The kernel's scheduling counters of one thread (`schedstat`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct SchedStat {
    pub run_time: Duration,
    /// Time on the run queue, up to its last time slice.
    pub wait_time: Duration,
    /// Number of time slices.
    pub time_slices: u64,
}

impl SchedStat {
    /// `None` if the thread has ended or the kernel keeps no such counters.
    pub(crate) fn read(file: &File) -> Option<Self> {
        let mut bytes = [0; 128];
        let count = file.read_at(&mut bytes, 0).ok()?;
        Self::parse(std::str::from_utf8(&bytes[..count]).ok()?)
    }

    /// Fields: nanoseconds running, nanoseconds waiting, number of time slices.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut numbers = text.split_ascii_whitespace().map(str::parse);
        let mut next = || numbers.next()?.ok();
        Some(Self {
            run_time: Duration::from_nanos(next()?),
            wait_time: Duration::from_nanos(next()?),
            time_slices: next()?,
        })
    }
}
