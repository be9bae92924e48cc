//! Results of remote workers that are stored in NATS and not yet accepted by the server. Their slots run other jobs by
//! now, so the server renews the leases. A lease is identified by its *nonce*, a random number.

use faceoff_wire::job::Lease;
use std::{
    collections::{HashMap, HashSet},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use uuid::Uuid;

/// A result that is accepted sooner needs no renewal.
const RENEW_AFTER: Duration = Duration::from_secs(2);

/// All pending results, by the nonces of their leases.
#[derive(Debug, Default)]
pub(super) struct PendingResults {
    pending: Mutex<HashMap<Uuid, PendingResult>>,
    /// Results that are being processed.
    processing: Mutex<HashSet<Uuid>>,
}

/// Marks a result as being processed until it is dropped.
#[derive(Debug)]
pub(super) struct ProcessingGuard<'a> {
    results: &'a PendingResults,
    nonce: Uuid,
}

impl Drop for ProcessingGuard<'_> {
    fn drop(&mut self) {
        self.results.processing().remove(&self.nonce);
    }
}

/// A result that has not been accepted.
#[derive(Debug, Clone)]
pub(super) struct PendingResult {
    pub(super) lease: Lease,
    pub(super) episodes_done: u32,
    /// Sequence number in the stream of results.
    pub(super) sequence: u64,
    pub(super) since: Instant,
}

impl PendingResults {
    pub(super) fn add(&self, lease: Lease, episodes_done: u32, sequence: u64, now: Instant) {
        let result = PendingResult {
            lease,
            episodes_done,
            sequence,
            since: now,
        };
        self.pending().insert(result.lease.nonce, result);
    }

    /// Removes a result that was accepted, or whose lease is lost.
    pub(super) fn remove(&self, nonce: Uuid) {
        self.pending().remove(&nonce);
    }

    /// Marks a result as being processed, so that it does not count as lost, and its job is not queued again, once it has left the
    /// stream.
    pub(super) fn start_processing(&self, nonce: Uuid) -> ProcessingGuard<'_> {
        self.processing().insert(nonce);
        ProcessingGuard {
            results: self,
            nonce,
        }
    }

    /// Is the result being processed, or was it processed?
    pub(super) fn is_processing_or_processed(&self, nonce: Uuid) -> bool {
        self.processing().contains(&nonce) || !self.pending().contains_key(&nonce)
    }

    /// The results that have been pending for [`RENEW_AFTER`] or longer.
    pub(super) fn due_for_renewal(&self, now: Instant) -> Vec<PendingResult> {
        let pending = self.pending();
        let is_due = |result: &&PendingResult| now.duration_since(result.since) >= RENEW_AFTER;
        pending.values().filter(is_due).cloned().collect()
    }

    /// A panic while the lock is held leaves every entry intact.
    fn pending(&self) -> MutexGuard<'_, HashMap<Uuid, PendingResult>> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn processing(&self) -> MutexGuard<'_, HashSet<Uuid>> {
        self.processing
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;

    const EPISODES_DONE: u32 = 50;

    #[test]
    fn pending_results_remain_until_they_are_accepted() {
        let (results, start) = (PendingResults::default(), Instant::now());
        let lease = |nonce| Lease {
            job_id: Uuid::from_u128(9),
            nonce: Uuid::from_u128(nonce),
            holder: "remote/a/slot-0".into(),
            expires_at: Timestamp::UNIX_EPOCH,
            duration_s: 30,
        };
        results.add(lease(1), EPISODES_DONE, 7, start);
        results.add(lease(2), EPISODES_DONE, 8, start + Duration::from_secs(1));
        assert!(
            results
                .due_for_renewal(start + Duration::from_secs(1))
                .is_empty()
        );
        let due_for_renewal = results.due_for_renewal(start + RENEW_AFTER);
        assert_eq!(due_for_renewal.len(), 1);
        assert_eq!(
            (
                due_for_renewal[0].lease.nonce,
                due_for_renewal[0].episodes_done,
                due_for_renewal[0].sequence
            ),
            (Uuid::from_u128(1), EPISODES_DONE, 7)
        );
        let nonce = Uuid::from_u128(1);
        assert!(!results.is_processing_or_processed(nonce));
        let guard = results.start_processing(nonce);
        assert!(
            results.is_processing_or_processed(nonce),
            "the result is being processed"
        );
        drop(guard);
        assert!(
            !results.is_processing_or_processed(nonce),
            "the result is pending again"
        );
        results.remove(nonce);
        assert!(
            results.is_processing_or_processed(nonce),
            "the result was processed"
        );
        results.remove(Uuid::from_u128(3));
        assert_eq!(
            results
                .due_for_renewal(start + Duration::from_secs(60))
                .len(),
            1
        );
    }
}
