//! Queries of leases: the right of a worker to run a job for a time. The nonce is unique to each lease.

use crate::{boxed_future, error::Result, queue, store::Store, tables::games};
use faceoff_types::{GameId, WorkerName};
use uuid::Uuid;

impl Store {
    /// Is the job leased under this nonce? An expired lease counts until another holder claims the job.
    #[boxed_future]
    pub async fn is_leased(&self, job: Uuid, nonce: Uuid) -> Result<bool> {
        queue::is_leased(&mut *self.database.read.acquire().await?, job, nonce).await
    }

    /// The lease holder of the job, if it is leased under this nonce.
    #[boxed_future]
    pub async fn lease_holder(&self, job: Uuid, nonce: Uuid) -> Result<Option<String>> {
        queue::lease_holder(&mut *self.database.read.acquire().await?, job, nonce).await
    }

    /// Does a slot of this remote worker hold the lease of the job under this nonce? Before the worker has started the
    /// job, the server itself holds the lease.
    #[boxed_future]
    pub async fn is_leased_by(&self, worker: &WorkerName, job: Uuid, nonce: Uuid) -> Result<bool> {
        let holder = self.lease_holder(job, nonce).await?;
        let slots = worker.slot_holder("");
        Ok(holder.is_some_and(|holder| holder.starts_with(&slots)))
    }

    /// The game that a job plays; `None` for other jobs.
    #[boxed_future]
    pub async fn game_of_job(&self, job: Uuid) -> Result<Option<GameId>> {
        games::of_job(&mut *self.database.read.acquire().await?, job).await
    }
}
