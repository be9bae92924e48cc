use crate::{
    boxed,
    error::Result,
    event::Actor,
    operations::{
        give_back::subject,
        purpose::{self, Purpose},
    },
    queue::{self, Claim},
    store::Store,
    tables::game_attempts,
};
use jiff::Timestamp;

impl Store {
    /// Extends the lease to `lease_s` seconds from now and stores the progress. False: the lease was
    /// lost or the work was cancelled, stop.
    #[boxed]
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
    /// lease was lost, or another one has begun. So of several who are given the same order one works at it; that one may ask again, since
    /// an answer may get lost.
    #[boxed]
    pub async fn hand_over(
        &self,
        claim: &Claim,
        to: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool> {
        let actor = Actor::Worker(to.to_owned());
        self.write(actor, now, async |tx| {
            if !queue::hand_over(tx, claim, to).await? {
                return Ok(false);
            }
            let Some(kind) = queue::renew(tx, claim, 0, lease_s, now).await? else {
                return Ok(false);
            };
            if let Purpose::Game(id) = purpose::of_unit(tx, claim.unit, &kind).await? {
                game_attempts::hand_over(tx, id, to).await?;
            }
            Ok(true)
        })
        .await
    }

    /// Gives the leases of `holder` and of all below it at least `lease_s` seconds from now on: they may have run out while nobody could
    /// renew them. Returns how many.
    #[boxed]
    pub async fn renew_leases_of(&self, holder: &str, lease_s: u32, now: Timestamp) -> Result<u64> {
        self.write(Actor::Server, now, async |tx| {
            queue::renew_of(tx, holder, lease_s).await
        })
        .await
    }
}
