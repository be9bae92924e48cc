use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, AtomicU64},
};

/// The size from which the log is copied and emptied although there are readers; four times of what
/// SQLite copies by itself. What one transaction writes comes on top.
pub const LOG_BOUND_BYTES: u64 = 16 << 20;

/// The log's file, and how it stands with emptying it.
#[derive(Debug)]
pub(crate) struct Log {
    file: PathBuf,
    pub(crate) emptying: AtomicBool,
    /// The size at which emptying is tried; above the bound after a failure, so that not every write
    /// tries.
    pub(crate) due_bytes: AtomicU64,
}

impl Log {
    pub(crate) const fn new(file: PathBuf) -> Self {
        Self {
            file,
            emptying: AtomicBool::new(false),
            due_bytes: AtomicU64::new(LOG_BOUND_BYTES),
        }
    }

    /// Its size; 0 before the first write.
    pub(crate) fn bytes(&self) -> u64 {
        self.file.metadata().map_or(0, |found| found.len())
    }
}
