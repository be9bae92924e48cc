//! A *clock step*: the system clock of the host is set. Due times of jobs and webhook deliveries move with it once an organiser
//! accepts the step.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::rerun_evaluation::RERUN_PAUSES_S,
    queue,
    store::Store,
    tables::deliveries,
};
use jiff::{SignedDuration, Timestamp};

/// No delivery waits longer than this for its next attempt; the longest actual pause is shorter.
const LONGEST_DELIVERY_PAUSE: SignedDuration = SignedDuration::from_hours(24);

impl Store {
    /// Moves leases, due times of jobs and due times of webhook deliveries, since the clock is about to be moved by `by`.
    /// `accept` moves the clock before the transaction is committed; no job is claimed in between. `now` is the time
    /// afterwards, `size` the text for the event. [`StoreError::Conflict`], and no change, if `accept` returns false.
    #[boxed_future]
    pub async fn accept_clock_step(
        &self,
        actor: Actor,
        by: SignedDuration,
        size: String,
        now: Timestamp,
        accept: Box<dyn FnOnce() -> bool + Send>,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            queue::shift_due_times(tx, by).await?;
            deliveries::shift(tx, by).await?;
            tx.record(Subject::Season, Event::ClockStepAccepted { size });
            if !accept() {
                return StoreError::conflict(
                    "the clock was set again, or the step was accepted already; look at the clock again",
                );
            }
            Ok(())
        })
        .await
    }

    /// Shortens due times that are too far in the future: they were stored when the clock was ahead. For the start of a
    /// server, whose leases last `lease_s`. Returns the number of jobs.
    #[boxed_future]
    pub async fn shorten_due_times(&self, lease_s: u32, now: Timestamp) -> Result<u64> {
        let longest_s = RERUN_PAUSES_S.into_iter().fold(lease_s, u32::max);
        self.write(Actor::Server, now, async |tx| {
            let latest = now.saturating_add(LONGEST_DELIVERY_PAUSE);
            deliveries::shorten(tx, latest.unwrap_or(Timestamp::MAX), now).await?;
            queue::shorten_due_times(tx, longest_s, lease_s).await
        })
        .await
    }
}
