//! Bans of remote workers (on other machines) whose results are not trusted.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::lease_release::requeue_leases_of,
    queue,
    store::Store,
    tables::{
        shards,
        worker_bans::{self, WorkerBan},
    },
};
use faceoff_types::WorkerName;
use jiff::Timestamp;

impl Store {
    /// Bans a worker. Its running jobs return to the queue at once. The shards (parts of runs) that it committed in
    /// unfinished runs are run again; returns the number of those shards. Finished results stay, for organisers to review
    /// ([`results_of_worker`](Self::results_of_worker)). [`StoreError::Conflict`] if it is banned already.
    #[boxed_future]
    pub async fn ban_worker(
        &self,
        actor: Actor,
        worker: &WorkerName,
        reason: &str,
        now: Timestamp,
    ) -> Result<u32> {
        let (holder, ban) = (
            worker.holder(),
            WorkerBan {
                worker: worker.to_string(),
                at: now,
                reason: reason.to_owned(),
            },
        );
        let discarded = self
            .write(actor, now, async |tx| {
                if !worker_bans::insert(tx, &ban).await? {
                    return StoreError::conflict(format!("the worker {worker} is banned already"));
                }
                // Results of these jobs that are not accepted yet are refused from now on.
                requeue_leases_of(tx, &holder).await?;
                let discarded = shards::committed_by_worker(tx, &holder).await?;
                for shard in &discarded {
                    shards::clear_result(tx, shard.id).await?;
                    queue::requeue(tx, shard.job).await?;
                }
                let event = Event::WorkerBanned {
                    worker: ban.worker,
                    reason: ban.reason,
                    repeated_shards: u32::try_from(discarded.len()).unwrap_or(u32::MAX),
                };
                tx.record(Subject::Season, event);
                Ok(discarded)
            })
            .await?;
        let count = u32::try_from(discarded.len()).unwrap_or(u32::MAX);
        for key in discarded.into_iter().filter_map(|shard| shard.recording) {
            if let Err(error) = self.artifacts().delete_folder(&key).await {
                // The recording is deleted later, together with all recordings of its run.
                tracing::warn!(key, %error, "could not delete a recording of a banned worker");
            }
        }
        Ok(count)
    }

    /// Lifts the ban of a worker. [`StoreError::Conflict`] if it is not banned.
    #[boxed_future]
    pub async fn readmit_worker(
        &self,
        actor: Actor,
        worker: &WorkerName,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            if !worker_bans::delete(tx, worker.as_str()).await? {
                return StoreError::conflict(format!("the worker {worker} is not banned"));
            }
            let worker = worker.to_string();
            tx.record(Subject::Season, Event::WorkerReadmitted { worker });
            Ok(())
        })
        .await
    }
}
