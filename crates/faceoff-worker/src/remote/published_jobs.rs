//! Jobs that the server has published to remote workers and that no worker has started yet.

use faceoff_wire::job::Lease;
use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use uuid::Uuid;

/// A worker that does not start a job within this time is assumed to be gone: the job goes back to the queue.
const START_TIMEOUT: Duration = Duration::from_secs(5);

/// A published job that has not been started.
#[derive(Debug, Clone)]
pub(super) struct PublishedJob {
    pub(super) lease: Lease,
    pub(super) description: String,
    /// Sequence number in the stream, once it is known.
    pub(super) sequence: Option<u64>,
    /// Start of the timeout: when the job was added, then when it was published.
    waiting_since: Instant,
}

/// All published jobs that have not been started, by the nonces (random identifiers) of their leases.
#[derive(Debug, Default)]
pub(super) struct PublishedJobs(Mutex<HashMap<Uuid, PublishedJob>>);

impl PublishedJobs {
    /// Adds a job. Call this before publishing, since a worker may start the job before NATS acknowledges it.
    pub(super) fn add(&self, lease: Lease, description: String, now: Instant) {
        let job = PublishedJob {
            lease,
            description,
            sequence: None,
            waiting_since: now,
        };
        self.all().insert(job.lease.nonce, job);
    }

    /// Records the sequence number of a published job; ignored if the job has been started.
    pub(super) fn set_published(&self, nonce: Uuid, sequence: u64, now: Instant) {
        if let Some(job) = self.all().get_mut(&nonce) {
            job.sequence = Some(sequence);
            // Workers receive the job only now, so the timeout begins again.
            job.waiting_since = now;
        }
    }

    pub(super) fn take(&self, nonce: Uuid) -> Option<PublishedJob> {
        self.all().remove(&nonce)
    }

    /// Removes and returns the jobs that were not started in time.
    pub(super) fn take_late(&self, now: Instant) -> Vec<PublishedJob> {
        let mut all = self.all();
        let is_late = |job: &PublishedJob| now.duration_since(job.waiting_since) >= START_TIMEOUT;
        all.extract_if(|_, job| is_late(job))
            .map(|(_, late)| late)
            .collect()
    }

    /// Removes and returns all jobs.
    pub(super) fn take_all(&self) -> Vec<PublishedJob> {
        self.all().drain().map(|(_, job)| job).collect()
    }

    /// A panic while the lock is held leaves every entry intact.
    fn all(&self) -> MutexGuard<'_, HashMap<Uuid, PublishedJob>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;

    #[test]
    fn jobs_not_started_in_time_are_returned_once() {
        let jobs = PublishedJobs::default();
        let start = Instant::now();
        let lease = |nonce| Lease {
            job_id: Uuid::from_u128(9),
            nonce: Uuid::from_u128(nonce),
            holder: "unclaimed".into(),
            expires_at: Timestamp::UNIX_EPOCH,
            duration_s: 30,
        };
        let add = |nonce, now| jobs.add(lease(nonce), "a shard of the task hit".into(), now);
        add(1, start);
        add(2, start);
        add(3, start + Duration::from_secs(1));
        jobs.set_published(Uuid::from_u128(1), 11, start);
        assert!(jobs.take(Uuid::from_u128(2)).is_some());
        // NATS may acknowledge a job after it was started.
        jobs.set_published(Uuid::from_u128(2), 12, start);
        assert!(jobs.take_late(start + Duration::from_secs(4)).is_empty());
        let late = jobs.take_late(start + START_TIMEOUT);
        assert_eq!(
            late.iter().map(|job| job.sequence).collect::<Vec<_>>(),
            [Some(11)]
        );
        assert_eq!(jobs.take_all().len(), 1);
        assert!(jobs.take_all().is_empty());
    }
}
