//! Gauges of the queue, for monitoring.

use crate::{boxed_future, error::Result, queue, store::Store};
use jiff::Timestamp;

/// Current numbers of jobs and evaluations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gauges {
    /// Jobs under a valid lease.
    pub running: u32,
    /// Jobs that a worker can claim.
    pub waiting: u32,
    /// Since when a worker can claim the first of them.
    pub waiting_since: Option<Timestamp>,
    /// Jobs that ran out of disk space repeatedly.
    pub out_of_space: u32,
    /// Has an organiser paused the queue?
    pub paused: bool,
    /// Evaluations of days that have not ended.
    pub open_evaluations: u32,
}

impl Store {
    /// Gauges of the queue at `now`.
    #[boxed_future]
    pub async fn gauges(&self, now: Timestamp) -> Result<Gauges> {
        let paused = self.season().await?.queue_pause.is_some();
        let mut connection = self.database.read.acquire().await?;
        let queue = queue::gauges(&mut connection, now).await?;
        let open_evaluations = sqlx::query_scalar!(
            r#"SELECT COUNT(*) AS "count!: u32" FROM counting_evaluations WHERE state = 'open'"#
        )
        .fetch_one(&mut *connection)
        .await?;
        Ok(Gauges {
            running: queue.running,
            waiting: queue.waiting,
            waiting_since: queue.waiting_since,
            out_of_space: queue.out_of_space,
            paused,
            open_evaluations,
        })
    }
}
