//! Is the store fit for work? Asked by whoever watches the server.

use crate::{
    boxed,
    error::Result,
    queue::{self, Standing},
    store::Store,
    tables::rulings::Ruling,
};
use jiff::{SignedDuration, Timestamp};
use std::sync::atomic::Ordering;

/// Answers about the database are as good as new for so long; a stranger who asks often costs no more
/// writes than this.
const PROBE_EVERY: SignedDuration = SignedDuration::from_secs(1);

/// Work that waits for longer than this while nobody works or looks for work is stuck.
const STUCK_AFTER: SignedDuration = SignedDuration::from_secs(60);

/// How the store stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// Can the database be written? It was tried.
    pub database_writable: bool,
    /// Does work get done?
    pub queue: QueueHealth,
}

/// How the queue stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum QueueHealth {
    /// What can be done is being done.
    Moving {
        /// Units under a lease that runs.
        running: u32,
        /// Units that could be begun.
        waiting: u32,
        /// Units that found no room again and again, although the disk is not short of it: they need more.
        without_room: u32,
    },
    /// Nothing is begun: there is too little [`Room`](crate::Room).
    Paused {
        /// Units that could be begun otherwise.
        waiting: u32,
    },
    /// Nothing is begun: the organiser holds it.
    Held {
        /// Units under a lease that runs.
        running: u32,
        /// Units that could be begun otherwise.
        waiting: u32,
        /// Since when, and why.
        ruling: Ruling,
    },
    /// Work waits, and nobody comes for it.
    Stuck {
        /// Units that could be begun.
        waiting: u32,
        /// Since when the first of them.
        since: Timestamp,
    },
    /// The database does not tell.
    Unknown,
}

impl Store {
    /// A worker of this process looked for work just now, and the queue answered.
    pub fn looked_for_work(&self, now: Timestamp) {
        self.pulse
            .looked_at
            .store(now.as_millisecond(), Ordering::Relaxed);
    }

    /// How the store stands. Nothing that anybody can see is changed by the question.
    #[boxed]
    pub async fn health(&self, now: Timestamp) -> Health {
        Health {
            database_writable: self.is_writable(now).await,
            queue: self.queue_health(now).await.unwrap_or(QueueHealth::Unknown),
        }
    }

    async fn is_writable(&self, now: Timestamp) -> bool {
        // one probe at a time: who comes meanwhile gets its answer
        let mut probed = self.pulse.probed.lock().await;
        if let Some((at, writable)) = *probed
            && now.duration_since(at).abs() < PROBE_EVERY
        {
            return writable;
        }
        let outcome = self.database.probe_write().await;
        if let Err(error) = &outcome
            && !matches!(*probed, Some((_, false)))
        {
            tracing::error!(%error, "the database cannot be written");
        }
        *probed = Some((now, outcome.is_ok()));
        outcome.is_ok()
    }

    async fn queue_health(&self, now: Timestamp) -> Result<QueueHealth> {
        let Standing {
            running,
            waiting,
            waiting_since,
            without_room,
        } = queue::standing(&mut *self.database.read.acquire().await?, now).await?;
        if self.room.is_short() {
            return Ok(QueueHealth::Paused { waiting });
        }
        if let Some(ruling) = self.season().await?.paused {
            return Ok(QueueHealth::Held {
                running,
                waiting,
                ruling,
            });
        }
        let since_looked = now
            .as_millisecond()
            .saturating_sub(self.pulse.looked_at.load(Ordering::Relaxed));
        let long = |since: Timestamp| now.duration_since(since) > STUCK_AFTER;
        Ok(match waiting_since {
            Some(since)
                if running == 0
                    && long(since)
                    && i128::from(since_looked) > STUCK_AFTER.as_millis() =>
            {
                QueueHealth::Stuck { waiting, since }
            }
            _ => QueueHealth::Moving {
                running,
                waiting,
                without_room,
            },
        })
    }
}
