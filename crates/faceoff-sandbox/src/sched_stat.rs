use std::{fs::File, os::unix::fs::FileExt, time::Duration};

/// What the kernel counts of one thread, by its `schedstat`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct SchedStat {
    pub ran: Duration,
    /// For a CPU, up to when it was last let run.
    pub waited: Duration,
    /// How often it was let run.
    pub slices: u64,
}

impl SchedStat {
    /// `None` of a thread that has ended, and where the kernel does not count.
    pub(crate) fn read(file: &File) -> Option<Self> {
        let mut bytes = [0; 128];
        let count = file.read_at(&mut bytes, 0).ok()?;
        Self::parse(std::str::from_utf8(&bytes[..count]).ok()?)
    }

    /// Nanoseconds of running and of waiting, and the number of slices.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut numbers = text.split_ascii_whitespace().map(str::parse);
        let mut next = || numbers.next()?.ok();
        Some(Self {
            ran: Duration::from_nanos(next()?),
            waited: Duration::from_nanos(next()?),
            slices: next()?,
        })
    }
}
