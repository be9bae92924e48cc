//! Signals: notifications to listeners in this process after each change of the database.

use crate::event::Change;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::sync::{broadcast, watch};

/// Number of changes that a receiver may be behind before it loses the oldest.
const MAX_BACKLOG: usize = 256;

/// Wakes this process's listeners after a commit. Only [`write`](crate::write) fires them.
#[derive(Debug)]
pub(crate) struct Signals {
    changes: broadcast::Sender<Change>,
    /// Number of times that jobs were added; only its change matters.
    jobs: watch::Sender<u64>,
    /// Number of committed transactions with visible changes.
    commits: AtomicU64,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self {
            changes: broadcast::Sender::new(MAX_BACKLOG),
            jobs: watch::Sender::new(0),
            commits: AtomicU64::new(0),
        }
    }

    /// Counts a commit of visible changes; also a commit of which it is unknown whether it failed.
    pub(crate) fn count_commit(&self) {
        self.commits.fetch_add(1, Ordering::Release);
    }

    pub(crate) fn commits(&self) -> u64 {
        self.commits.load(Ordering::Acquire)
    }

    pub(crate) fn send(&self, change: Change) {
        // sending fails only if there is no listener
        let _ = self.changes.send(change);
    }

    /// Wakes idle workers: a job may be claimed.
    pub(crate) fn job_added(&self) {
        self.jobs
            .send_modify(|count| *count = count.wrapping_add(1));
    }

    pub(crate) fn changes(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    pub(crate) fn jobs(&self) -> watch::Receiver<u64> {
        self.jobs.subscribe()
    }
}
