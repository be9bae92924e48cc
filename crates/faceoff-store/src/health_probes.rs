//! [`HealthProbes`]: what the store remembers between two reports of its health.

use jiff::Timestamp;
use std::sync::atomic::AtomicI64;
use tokio::sync::Mutex;

/// The latest signs of health of workers and database.
#[derive(Debug)]
pub(crate) struct HealthProbes {
    /// When a worker last polled successfully for a job; milliseconds since 1970.
    pub(crate) last_poll_ms: AtomicI64,
    /// Time of the last write probe of the database, and whether it succeeded.
    pub(crate) last_write: Mutex<Option<(Timestamp, bool)>>,
}

impl HealthProbes {
    pub(crate) const fn new() -> Self {
        Self {
            last_poll_ms: AtomicI64::new(i64::MIN),
            last_write: Mutex::const_new(None),
        }
    }
}
