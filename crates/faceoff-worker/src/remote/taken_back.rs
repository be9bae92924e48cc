//! Orders that were given out and that nobody has begun yet.

use faceoff_wire::work::Lease;
use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use uuid::Uuid;

/// Whoever asked for an order begins within this time, or has gone: then it is taken back, and given to another.
const BEGINS_WITHIN: Duration = Duration::from_secs(5);

/// An order that waits for its worker.
#[derive(Debug, Clone)]
pub(super) struct GivenOut {
    pub(super) lease: Lease,
    pub(super) what: String,
    /// Its place in the stream, once that is known.
    pub(super) sequence: Option<u64>,
    at: Instant,
}

/// By the leases' nonces.
#[derive(Debug, Default)]
pub(super) struct AllGivenOut(Mutex<HashMap<Uuid, GivenOut>>);

impl AllGivenOut {
    /// Before it is published: a worker may begin it sooner than NATS says that it has it.
    pub(super) fn add(&self, lease: Lease, what: String, now: Instant) {
        let given_out = GivenOut {
            lease,
            what,
            sequence: None,
            at: now,
        };
        self.all().insert(given_out.lease.nonce, given_out);
    }

    /// It is in the stream; nothing to be kept if it has been begun by then.
    pub(super) fn is_published(&self, nonce: Uuid, sequence: u64, now: Instant) {
        if let Some(of) = self.all().get_mut(&nonce) {
            of.sequence = Some(sequence);
            // Before, nobody could begin it.
            of.at = now;
        }
    }

    pub(super) fn take(&self, nonce: Uuid) -> Option<GivenOut> {
        self.all().remove(&nonce)
    }

    /// Those that nobody has begun in time; they are forgotten.
    pub(super) fn take_late(&self, now: Instant) -> Vec<GivenOut> {
        let mut all = self.all();
        let is_late = |of: &GivenOut| now.duration_since(of.at) >= BEGINS_WITHIN;
        all.extract_if(|_, of| is_late(of))
            .map(|(_, late)| late)
            .collect()
    }

    /// All of them; they are forgotten.
    pub(super) fn take_all(&self) -> Vec<GivenOut> {
        self.all().drain().map(|(_, of)| of).collect()
    }

    /// Each entry is whole whatever panicked beside it.
    fn all(&self) -> MutexGuard<'_, HashMap<Uuid, GivenOut>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;

    #[test]
    fn what_nobody_begins_in_time_is_taken_back_once() {
        let all = AllGivenOut::default();
        let start = Instant::now();
        let lease = |nonce| Lease {
            unit: Uuid::from_u128(9),
            nonce: Uuid::from_u128(nonce),
            slot: "x".into(),
            expires_at: Timestamp::UNIX_EPOCH,
            duration_s: 30,
        };
        let add = |nonce, at| all.add(lease(nonce), "hit".into(), at);
        add(1, start);
        add(2, start);
        add(3, start + Duration::from_secs(1));
        all.is_published(Uuid::from_u128(1), 11, start);
        assert!(all.take(Uuid::from_u128(2)).is_some());
        // NATS may say so after it was begun.
        all.is_published(Uuid::from_u128(2), 12, start);
        assert!(all.take_late(start + Duration::from_secs(4)).is_empty());
        let late = all.take_late(start + BEGINS_WITHIN);
        assert_eq!(
            late.iter().map(|of| of.sequence).collect::<Vec<_>>(),
            [Some(11)]
        );
        assert_eq!(all.take_all().len(), 1);
        assert!(all.take_all().is_empty());
    }
}
