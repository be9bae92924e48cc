//! What a worker on another machine did is not believed any more, or again.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::give_back::give_back_all,
    queue,
    store::Store,
    tables::{
        shards,
        worker_bans::{self, WorkerBan},
    },
    workers::WorkerName,
};
use jiff::Timestamp;

impl Store {
    /// Takes nothing of a worker any more. What it has under way is given to others at once, and what it played of runs that are not over is
    /// played again; how many shards that is. What is over stays, to be judged by people ([`played_by`](Self::played_by)).
    /// [`StoreError::Conflict`] if it is banned already.
    #[boxed]
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
        let again = self
            .write(actor, now, async |tx| {
                if !worker_bans::insert(tx, &ban).await? {
                    return Err(StoreError::Conflict(format!(
                        "the worker {worker} is banned already"
                    )));
                }
                // Also of what is just being looked at: it was played by somebody who is not believed.
                give_back_all(tx, &holder).await?;
                let played = shards::of_running_by(tx, &holder).await?;
                for shard in &played {
                    shards::take_back(tx, shard.id).await?;
                    queue::queue_again(tx, shard.unit).await?;
                }
                let event = Event::WorkerBanned {
                    worker: ban.worker,
                    reason: ban.reason,
                    again: u32::try_from(played.len()).unwrap_or(u32::MAX),
                };
                tx.record(Subject::Season, event);
                Ok(played)
            })
            .await?;
        self.workers().ban(worker.as_str(), reason);
        let count = u32::try_from(again.len()).unwrap_or(u32::MAX);
        for key in again.into_iter().filter_map(|shard| shard.recording) {
            if let Err(error) = self.artifacts().delete_folder(&key).await {
                // It goes with its run's.
                tracing::warn!(key, %error, "a recording that nobody believes is left");
            }
        }
        Ok(count)
    }

    /// Takes a worker's work again. [`StoreError::Conflict`] if it is not banned.
    #[boxed]
    pub async fn readmit_worker(
        &self,
        actor: Actor,
        worker: &WorkerName,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            if !worker_bans::delete(tx, worker.as_str()).await? {
                return Err(StoreError::Conflict(format!(
                    "the worker {worker} is not banned"
                )));
            }
            let worker = worker.to_string();
            tx.record(Subject::Season, Event::WorkerReadmitted { worker });
            Ok(())
        })
        .await?;
        self.workers().readmit(worker.as_str());
        Ok(())
    }
}
