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
}
