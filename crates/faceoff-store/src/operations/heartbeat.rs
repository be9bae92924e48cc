//! Leases of running jobs: a worker renews its lease by heartbeats, or transfers it to another worker.

use crate::{
    boxed_future,
    error::Result,
    event::Actor,
    operations::{
        job_purpose::{self, JobPurpose},
        lease_release::event_subject,
    },
    queue::{self, JobClaim},
    store::Store,
    tables::game_attempts,
};
use jiff::Timestamp;

impl Store {
    /// Extends the lease to `lease_s` seconds from now and stores the progress. False: the lease was
    /// lost or the job was cancelled, so the worker must stop.
    #[boxed_future]
    pub async fn heartbeat(
        &self,
        claim: &JobClaim,
        episodes_done: u32,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool> {
        let actor = Actor::Worker(claim.holder.clone());
        self.write(actor, now, async |tx| {
            let Some(kind) = queue::renew(tx, claim, episodes_done, lease_s, now).await? else {
                return Ok(false);
            };
            let purpose = job_purpose::of_job(tx, claim.job, &kind).await?;
            let subject = event_subject(tx, &purpose).await?;
            tx.record_progress(subject);
            Ok(true)
        })
        .await
    }

    /// Transfers a lease that `claim.holder` took in advance to the worker that starts the job, extended to `lease_s`
    /// seconds from now. False: the lease was lost, or another worker has started the job. So only one of several workers
    /// that got the same job runs it. That worker may repeat the call, since a response can get lost.
    #[boxed_future]
    pub async fn transfer_lease(
        &self,
        claim: &JobClaim,
        new_holder: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool> {
        let actor = Actor::Worker(new_holder.to_owned());
        self.write(actor, now, async |tx| {
            if !queue::transfer(tx, claim, new_holder).await? {
                return Ok(false);
            }
            let Some(kind) = queue::renew(tx, claim, 0, lease_s, now).await? else {
                return Ok(false);
            };
            if let JobPurpose::Game(id) = job_purpose::of_job(tx, claim.job, &kind).await? {
                game_attempts::transfer(tx, id, new_holder).await?;
            }
            Ok(true)
        })
        .await
    }

    /// Extends the leases of `holder`, and of every name `holder/…`, to at least `lease_s` seconds from now. They may have
    /// expired while heartbeats could not be stored. Returns the number of leases.
    #[boxed_future]
    pub async fn renew_leases_of(&self, holder: &str, lease_s: u32, now: Timestamp) -> Result<u64> {
        self.write(Actor::Server, now, async |tx| {
            queue::renew_leases(tx, holder, lease_s).await
        })
        .await
    }
}
