use crate::{
    error::Result,
    event::Actor,
    operations::{give_back::subject, purpose},
    queue::{self, Claim},
    store::Store,
};
use jiff::Timestamp;

impl Store {
    /// Extends the lease to `lease_s` seconds from now and stores the progress. False: the lease was
    /// lost or the work was cancelled, stop.
    pub async fn heartbeat(
        &self,
        claim: &Claim,
        episodes_done: u32,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool> {
        let actor = Actor::Worker(claim.worker.clone());
        self.write(actor, now, async |tx| {
            let Some(kind) = queue::renew(tx, claim, episodes_done, lease_s, now).await? else {
                return Ok(false);
            };
            let purpose = purpose::of_unit(tx, claim.unit, &kind).await?;
            let subject = subject(tx, &purpose).await?;
            tx.advanced(subject);
            Ok(true)
        })
        .await
    }

    /// What was claimed in advance, by `claim.worker`, is begun by another, with a new lease of `lease_s` seconds. False: the
    /// lease was lost, or another one has begun. So of several who are given the same order one works at it.
    pub async fn hand_over(
        &self,
        claim: &Claim,
        to: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool> {
        let actor = Actor::Worker(to.to_owned());
        self.write(actor, now, async |tx| {
            Ok(queue::hand_over(tx, claim, to).await?
                && queue::renew(tx, claim, 0, lease_s, now).await?.is_some())
        })
        .await
    }
}
