//! How much is under way, for whoever watches the server.

use crate::{boxed, error::Result, queue, store::Store};
use jiff::Timestamp;

/// How much is under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Numbers {
    /// Units under a lease that runs.
    pub running: u32,
    /// Units that could be begun.
    pub waiting: u32,
    /// Since when the first of them could.
    pub waiting_since: Option<Timestamp>,
    /// Units that found no room again and again.
    pub without_room: u32,
    /// An organiser holds the queue.
    pub held: bool,
    /// Evaluations that are not over.
    pub open_evaluations: u32,
}

impl Store {
    /// How much is under way.
    #[boxed]
    pub async fn numbers(&self, now: Timestamp) -> Result<Numbers> {
        let held = self.season().await?.paused.is_some();
        let mut connection = self.database.read.acquire().await?;
        let standing = queue::standing(&mut connection, now).await?;
        let open_evaluations = sqlx::query_scalar!(
            r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations WHERE state = 'open'"#
        )
        .fetch_one(&mut *connection)
        .await?;
        Ok(Numbers {
            running: standing.running,
            waiting: standing.waiting,
            waiting_since: standing.waiting_since,
            without_room: standing.without_room,
            held,
            open_evaluations,
        })
    }
}
