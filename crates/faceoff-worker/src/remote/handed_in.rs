//! What workers have handed in to NATS and the server has not taken in yet: its slots work at something else, so the server keeps the leases.

use faceoff_wire::work::Lease;
use std::{
    collections::{HashMap, HashSet},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use uuid::Uuid;

/// What is taken in at once needs nothing.
const WAITS_AFTER: Duration = Duration::from_secs(2);

/// By the leases' nonces.
#[derive(Debug, Default)]
pub(super) struct AllHandedIn {
    waiting: Mutex<HashMap<Uuid, HandedIn>>,
    /// What is being looked at.
    taken: Mutex<HashSet<Uuid>>,
}

/// An outcome is being looked at for as long as this lives.
#[derive(Debug)]
pub(super) struct Here<'a> {
    all: &'a AllHandedIn,
    nonce: Uuid,
}

impl Drop for Here<'_> {
    fn drop(&mut self) {
        self.all.taken().remove(&self.nonce);
    }
}

/// An outcome that waits.
#[derive(Debug, Clone)]
pub(super) struct HandedIn {
    pub(super) lease: Lease,
    pub(super) episodes_done: u32,
    /// Where it is in the stream of outcomes.
    pub(super) sequence: u64,
    pub(super) since: Instant,
}

impl AllHandedIn {
    pub(super) fn add(&self, lease: Lease, episodes_done: u32, sequence: u64, now: Instant) {
        let waits = HandedIn {
            lease,
            episodes_done,
            sequence,
            since: now,
        };
        self.all().insert(waits.lease.nonce, waits);
    }

    /// It is taken in, or nobody's any more.
    pub(super) fn forget(&self, nonce: Uuid) {
        self.all().remove(&nonce);
    }

    /// It is here, whatever becomes of the stream.
    pub(super) fn take(&self, nonce: Uuid) -> Here<'_> {
        self.taken().insert(nonce);
        Here { all: self, nonce }
    }

    /// Is it here, or was it?
    pub(super) fn is_taken(&self, nonce: Uuid) -> bool {
        self.taken().contains(&nonce) || !self.all().contains_key(&nonce)
    }

    /// All that waits for a while by now.
    pub(super) fn waiting(&self, now: Instant) -> Vec<HandedIn> {
        let all = self.all();
        let waits = |of: &&HandedIn| now.duration_since(of.since) >= WAITS_AFTER;
        all.values().filter(waits).cloned().collect()
    }

    /// Each entry is whole whatever panicked beside it.
    fn all(&self) -> MutexGuard<'_, HashMap<Uuid, HandedIn>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn taken(&self) -> MutexGuard<'_, HashSet<Uuid>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;

    #[test]
    fn what_waits_is_kept_until_it_is_taken_in() {
        let (all, start) = (AllHandedIn::default(), Instant::now());
        let lease = |nonce| Lease {
            unit: Uuid::from_u128(9),
            nonce: Uuid::from_u128(nonce),
            slot: "remote/a/slot-0".into(),
            expires_at: Timestamp::UNIX_EPOCH,
            duration_s: 30,
        };
        all.add(lease(1), 50, 7, start);
        all.add(lease(2), 50, 8, start + Duration::from_secs(1));
        assert!(all.waiting(start + Duration::from_secs(1)).is_empty());
        let waits = all.waiting(start + WAITS_AFTER);
        assert_eq!(waits.len(), 1);
        assert_eq!(
            (
                waits[0].lease.nonce,
                waits[0].episodes_done,
                waits[0].sequence
            ),
            (Uuid::from_u128(1), 50, 7)
        );
        let nonce = Uuid::from_u128(1);
        assert!(!all.is_taken(nonce));
        let here = all.take(nonce);
        assert!(all.is_taken(nonce), "it is here");
        drop(here);
        assert!(!all.is_taken(nonce), "it waits again");
        all.forget(nonce);
        assert!(all.is_taken(nonce), "it was here");
        all.forget(Uuid::from_u128(3));
        assert_eq!(all.waiting(start + Duration::from_secs(60)).len(), 1);
    }
}
