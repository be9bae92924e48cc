use crate::event::Change;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::sync::{broadcast, watch};

/// How many changes a receiver may be behind before it misses the oldest.
const BACKLOG: usize = 256;

/// Wakes this process's listeners after a commit. Only [`write`](crate::write) fires them.
#[derive(Debug)]
pub(crate) struct Signals {
    changes: broadcast::Sender<Change>,
    work: watch::Sender<u64>,
    /// How many changes were committed.
    made: AtomicU64,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self {
            changes: broadcast::Sender::new(BACKLOG),
            work: watch::Sender::new(0),
            made: AtomicU64::new(0),
        }
    }

    /// Something that is told of was committed, or may have been.
    pub(crate) fn committed(&self) {
        self.made.fetch_add(1, Ordering::Release);
    }

    pub(crate) fn made(&self) -> u64 {
        self.made.load(Ordering::Acquire)
    }

    pub(crate) fn changed(&self, change: Change) {
        // no listener is no fault
        let _ = self.changes.send(change);
    }

    /// Tells idle workers that a unit may be claimed.
    pub(crate) fn work_added(&self) {
        self.work
            .send_modify(|count| *count = count.wrapping_add(1));
    }

    pub(crate) fn changes(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    pub(crate) fn work(&self) -> watch::Receiver<u64> {
        self.work.subscribe()
    }
}
