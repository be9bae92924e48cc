use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    queue,
    store::Store,
    tables::{rulings::Ruling, season},
};
use jiff::Timestamp;

impl Store {
    /// Holds the queue: no unit of work is begun, what is begun is played to its end, days start and wait.
    /// [`StoreError::Conflict`] if it is held.
    #[boxed]
    pub async fn pause_queue(&self, actor: Actor, reason: &str, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            if season::is_paused(tx).await? {
                return Err(StoreError::Conflict("the queue is paused already".into()));
            }
            let ruling = Ruling {
                at: now,
                reason: reason.to_owned(),
            };
            season::set_paused(tx, Some(&ruling)).await?;
            let reason = ruling.reason;
            tx.record(Subject::Season, Event::QueuePaused { reason });
            Ok(())
        })
        .await
    }

    /// Lets the queue go on. [`StoreError::Conflict`] if it is not held.
    #[boxed]
    pub async fn resume_queue(&self, actor: Actor, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            if !season::is_paused(tx).await? {
                return Err(StoreError::Conflict("the queue is not paused".into()));
            }
            season::set_paused(tx, None).await?;
            tx.record(Subject::Season, Event::QueueResumed);
            queue::goes_on(tx);
            Ok(())
        })
        .await
    }
}
