//! Pause of the job queue by an organiser.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    queue,
    store::Store,
    tables::{decision_records::DecisionRecord, season},
};
use jiff::Timestamp;

impl Store {
    /// Pauses the queue: no job is started, running jobs continue to their end, new days are queued.
    /// [`StoreError::Conflict`] if it is paused already.
    #[boxed_future]
    pub async fn pause_queue(&self, actor: Actor, reason: &str, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            if season::is_paused(tx).await? {
                return StoreError::conflict("the queue is paused already");
            }
            let decision = DecisionRecord {
                at: now,
                reason: reason.to_owned(),
            };
            season::set_paused(tx, Some(&decision)).await?;
            let reason = decision.reason;
            tx.record(Subject::Season, Event::QueuePaused { reason });
            Ok(())
        })
        .await
    }

    /// Resumes the queue. [`StoreError::Conflict`] if it is not paused.
    #[boxed_future]
    pub async fn resume_queue(&self, actor: Actor, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            if !season::is_paused(tx).await? {
                return StoreError::conflict("the queue is not paused");
            }
            season::set_paused(tx, None).await?;
            tx.record(Subject::Season, Event::QueueResumed);
            queue::wake_workers(tx);
            Ok(())
        })
        .await
    }
}
