//! The interface between a slot, which runs jobs, and the server, which owns the queue of jobs.

use faceoff_types::GameId;
use faceoff_wire::{
    job::{JobReport, JobSpec, Lease},
    remote::LiveGameUpdate,
};
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// The server as a slot sees it: the owner of the queue, in this process or on another machine. A slot has its
/// own thread, so all calls block. The server sets all timestamps, at the time of the call.
///
/// After an error the outcome is unknown: the request may have been carried out.
pub(crate) trait JobServer: Send + Sync {
    /// Leases the next job to the slot with this name.
    fn claim(&self, slot: &str) -> anyhow::Result<ClaimResult>;

    /// Renews the lease and reports progress.
    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<LeaseStatus>;

    /// Interval between renewals: three tries before the lease expires.
    fn renewal_interval(&self, lease: &Lease) -> Duration {
        Duration::from_secs(lease.duration_s.into()) / 3
    }

    /// Publishes a live update of a game. `attempt` is the game's id and the number of the attempt, from 1. Updates may get lost over
    /// a slow or broken connection.
    fn publish_game(&self, lease: &Lease, attempt: (GameId, u32), update: LiveGameUpdate);

    /// Stores the result of a job; a repetition under the same lease has no effect. Files that were uploaded under a lost
    /// lease are removed.
    fn commit(&self, lease: &Lease, report: JobReport) -> anyhow::Result<LeaseStatus>;

    /// Puts a job back into the queue. For a lost lease nothing is recorded.
    fn release(&self, lease: &Lease, reason: ReleaseReason<'_>) -> anyhow::Result<()>;

    /// Was a full disk, of the slot's or the server's host, the cause of this error? Then the attempt does not count.
    fn is_full_disk(&self, error: &anyhow::Error) -> bool;

    /// Waits until `stop` is cancelled, `timeout` has passed or, if a queue version is given, jobs were added since it.
    fn wait(
        &self,
        stop: &CancellationToken,
        timeout: Duration,
        queue_version: Option<QueueVersion>,
    );
}

/// The result of a claim.
#[derive(Debug)]
pub(crate) enum ClaimResult {
    Job(Box<JobSpec>),
    /// No job can be claimed now.
    Empty {
        /// Version of the queue before the claim. [`JobServer::wait`] with it misses no job that was added since.
        queue_version: QueueVersion,
    },
}

/// A version of the queue; it changes with every addition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueVersion(pub(crate) u64);

/// Whether a slot still has the lease of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LeaseStatus {
    /// The slot has the lease, or has completed the job.
    Held,
    /// The lease has expired, or the job was cancelled or given to another slot.
    Lost,
}

/// Why a job is released, that is, goes back to the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReleaseReason<'a> {
    /// The job was interrupted without a fault: the worker shuts down, or its program is of another version than the server's.
    /// The attempt does not count.
    Interrupted,
    /// The disk was full. The job is tried again when there is free space, and the attempt does not count.
    FullDisk,
    /// A platform fault, with a description for the team. After several attempts the job fails.
    PlatformFault(&'a str),
}

/// The result of a remote slot exceeds the maximum message size of NATS.
#[derive(Debug, thiserror::Error)]
#[error(
    "the result has {bytes} bytes, but NATS accepts messages of at most {max_payload}: raise its max_payload"
)]
pub(crate) struct TooLarge {
    pub(crate) bytes: usize,
    pub(crate) max_payload: usize,
}
