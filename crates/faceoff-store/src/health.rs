//! Health of the database and of the queue, for monitoring.

use crate::{
    boxed_future,
    error::Result,
    queue::{self, QueueGauges},
    store::Store,
    tables::decision_records::DecisionRecord,
};
use jiff::{SignedDuration, Timestamp};
use std::sync::atomic::Ordering;

/// The result of a write probe (a test whether the database can be written) is reused for this time. Requests for the
/// health need no account; however frequent they are, they cause one write per interval at most.
const PROBE_INTERVAL: SignedDuration = SignedDuration::from_secs(1);

/// The queue is stuck if a job has waited for longer than this while no job runs and no worker polls.
const STUCK_AFTER: SignedDuration = SignedDuration::from_secs(60);

/// Health of the store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// Did the last write probe of the database succeed?
    pub database_writable: bool,
    pub queue: QueueHealth,
}

/// Health of the queue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum QueueHealth {
    /// Jobs are processed.
    Running {
        /// Jobs under a valid lease.
        running: u32,
        /// Jobs that a worker can claim.
        waiting: u32,
        /// Jobs that ran out of disk space repeatedly although the required minimum was free: they need more than that.
        out_of_space: u32,
    },
    /// No job starts: there is too little [`FreeSpace`](crate::FreeSpace).
    DiskFull {
        /// Jobs that a worker could claim otherwise.
        waiting: u32,
    },
    /// No job starts: an organiser has paused the queue.
    Paused {
        /// Jobs under a valid lease.
        running: u32,
        /// Jobs that a worker could claim otherwise.
        waiting: u32,
        /// Time and reason of the pause.
        decision: DecisionRecord,
    },
    /// Jobs can be claimed, and no worker polls for them.
    Stuck {
        /// Jobs that a worker can claim.
        waiting: u32,
        /// Since when a worker can claim the first of them.
        since: Timestamp,
    },
    /// The database cannot be read.
    Unknown,
}

impl Store {
    /// Records that a worker of this process polled for a job and the queue answered.
    pub fn record_poll(&self, now: Timestamp) {
        self.probes
            .last_poll_ms
            .store(now.as_millisecond(), Ordering::Relaxed);
    }

    /// Health of the store. The write probe changes no data.
    #[boxed_future]
    pub async fn health(&self, now: Timestamp) -> Health {
        Health {
            database_writable: self.is_writable(now).await,
            queue: self.queue_health(now).await.unwrap_or(QueueHealth::Unknown),
        }
    }

    async fn is_writable(&self, now: Timestamp) -> bool {
        // one probe at a time: concurrent callers wait and get its result
        let mut last_write = self.probes.last_write.lock().await;
        if let Some((probed_at, writable)) = *last_write
            && now.duration_since(probed_at).abs() < PROBE_INTERVAL
        {
            return writable;
        }
        let outcome = self.database.probe_write().await;
        if let Err(error) = &outcome
            && !matches!(*last_write, Some((_, false)))
        {
            tracing::error!(%error, "the database cannot be written");
        }
        *last_write = Some((now, outcome.is_ok()));
        outcome.is_ok()
    }

    async fn queue_health(&self, now: Timestamp) -> Result<QueueHealth> {
        let QueueGauges {
            running,
            waiting,
            waiting_since,
            out_of_space,
        } = queue::gauges(&mut *self.database.read.acquire().await?, now).await?;
        if self.free_space.is_short() {
            return Ok(QueueHealth::DiskFull { waiting });
        }
        if let Some(decision) = self.season().await?.queue_pause {
            return Ok(QueueHealth::Paused {
                running,
                waiting,
                decision,
            });
        }
        // The absolute value, since the clock may have been set back after the poll.
        let since_poll_ms = now
            .as_millisecond()
            .saturating_sub(self.probes.last_poll_ms.load(Ordering::Relaxed))
            .saturating_abs();
        let is_overdue = |since: Timestamp| now.duration_since(since) > STUCK_AFTER;
        Ok(match waiting_since {
            Some(since)
                if running == 0
                    && is_overdue(since)
                    && i128::from(since_poll_ms) > STUCK_AFTER.as_millis() =>
            {
                QueueHealth::Stuck { waiting, since }
            }
            _ => QueueHealth::Running {
                running,
                waiting,
                out_of_space,
            },
        })
    }
}
