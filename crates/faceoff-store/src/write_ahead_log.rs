//! [`WriteAheadLog`]: the file to which SQLite appends changes until a checkpoint copies them into the database.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, AtomicU64},
};

/// The size from which the write-ahead log is emptied although there are readers: four times the size at
/// which SQLite copies automatically. One transaction can exceed it.
pub const MAX_LOG_BYTES: u64 = 16 << 20;

/// The log's file, and the state of the attempts to empty it.
#[derive(Debug)]
pub(crate) struct WriteAheadLog {
    file: PathBuf,
    /// Is an attempt to empty it running?
    pub(crate) is_emptying: AtomicBool,
    /// The size at which the next attempt is due. It is above the limit after a failure, so that not every
    /// write tries again.
    pub(crate) due_bytes: AtomicU64,
}

impl WriteAheadLog {
    pub(crate) const fn new(file: PathBuf) -> Self {
        Self {
            file,
            is_emptying: AtomicBool::new(false),
            due_bytes: AtomicU64::new(MAX_LOG_BYTES),
        }
    }

    /// Size of the file; 0 before the first write.
    pub(crate) fn bytes(&self) -> u64 {
        self.file.metadata().map_or(0, |metadata| metadata.len())
    }
}
