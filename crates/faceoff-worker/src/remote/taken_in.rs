//! Takes in what came of work elsewhere, once it is checked.

use super::{
    dispatch::{Hub, LOOK},
    granted::{Taken, of_its_order, store},
    handed_in::HandedIn,
    names,
};
use crate::server::{GivenBack, Holding, WorkServer};
use anyhow::Context as _;
use async_nats::jetstream::{self, AckKind};
use faceoff_store::{Actor, StoreError, WorkerName};
use faceoff_types::harmless;
use faceoff_wire::{
    grant::Grant,
    remote::{Outcome, RemoteOutcome},
};
use futures::StreamExt as _;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use tokio::task::{JoinError, JoinSet};
use tokio_util::sync::CancellationToken;

/// An outcome that cannot be stored now is taken again after this.
const AGAIN: Duration = Duration::from_secs(5);
/// What is still being stored of an outcome is there soon.
const SOON: Duration = Duration::from_secs(1);
/// So many outcomes are checked at the same time: each takes a thread of its own for a while.
const CHECKED_AT_ONCE: usize = 2;
/// So many of those that wait are looked for in their stream each time: each is read there as a whole.
const LOOKED_FOR_AT_ONCE: usize = 16;
/// So much is kept of what a worker says of its own fault, in characters.
const REASON_SHOWN: usize = 500;

impl Hub {
    /// Asks for no more than is begun at once: what was fetched and waits would come again after a while, and others would have its unit.
    pub(super) async fn take_in(
        self: &Arc<Self>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let mut taking = JoinSet::new();
        let mut ended = self.fetch(&mut taking, shutdown).await;
        // What is being checked is not broken off, whatever keeps others from being fetched.
        while let Some(done) = taking.join_next().await {
            ended = ended.and(taken(Some(done)));
        }
        ended
    }

    async fn fetch(
        self: &Arc<Self>,
        taking: &mut JoinSet<anyhow::Result<()>>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let mut consumer = self.streams.outcomes().await?;
        let mut held_back = None;
        while !shutdown.is_cancelled() {
            while taking.len() >= CHECKED_AT_ONCE {
                taken(taking.join_next().await)?;
            }
            let mut outcomes = consumer
                .batch()
                .max_messages(CHECKED_AT_ONCE - taking.len())
                .expires(LOOK)
                .messages()
                .await
                .context("asking for what came of work")?;
            let mut are_none = true;
            while let Some(message) = outcomes.next().await {
                are_none = false;
                let message = message.map_err(|error| anyhow::anyhow!(error))?;
                let hub = Arc::clone(self);
                taking.spawn(async move {
                    let acknowledgement = hub.take(&message).await;
                    let acknowledged = message.ack_with(acknowledgement).await;
                    acknowledged.map_err(|error| anyhow::anyhow!(error))
                });
            }
            while let Some(done) = taking.try_join_next() {
                taken(Some(done))?;
            }
            if are_none {
                let checked = self.streams.check_outcomes(&mut consumer, &mut held_back);
                checked.await?;
            }
        }
        Ok(())
    }

    /// Keeps what is handed in for as long as it waits here: whose it was works at something else. What NATS has lost is played again.
    pub(super) async fn keep_waiting(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let every = Duration::from_secs(self.server.lease_s.into()) / 3;
        while !shutdown.is_cancelled() {
            let mut waiting = self.handed_in.waiting(Instant::now());
            for HandedIn {
                lease,
                episodes_done,
                ..
            } in waiting.clone()
            {
                let (server, nonce) = (self.server.clone(), lease.nonce);
                let renewed =
                    tokio::task::spawn_blocking(move || server.renew(&lease, episodes_done));
                if renewed.await?? == Holding::Lost {
                    self.handed_in.forget(nonce);
                }
            }
            // Outcomes come in order, so those that wait for long say enough of all.
            waiting.sort_by_key(|waits| waits.since);
            waiting.truncate(LOOKED_FOR_AT_ONCE);
            for HandedIn {
                lease, sequence, ..
            } in waiting
            {
                let is_there = self.streams.has_outcome(&lease, sequence).await?;
                // What is here is not lost, and what was taken in meanwhile is there no more, either.
                if is_there || self.handed_in.is_taken(lease.nonce) {
                    continue;
                }
                self.handed_in.forget(lease.nonce);
                tracing::warn!(unit = %lease.unit, slot = lease.slot, "NATS has lost what came of a unit: it is played again");
                let server = self.server.clone();
                let given_back = tokio::task::spawn_blocking(move || {
                    server.give_back(&lease, GivenBack::Shutdown)
                });
                given_back.await??;
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = tokio::time::sleep(every) => {}
            }
        }
        Ok(())
    }

    /// Stores what came of an order.
    async fn take(&self, message: &jetstream::Message) -> AckKind {
        let Some(worker) = names::worker_of(&message.subject) else {
            tracing::error!(subject = %message.subject, "an outcome of no worker; it is left out");
            return AckKind::Term;
        };
        let mut outcome: RemoteOutcome = match serde_json::from_slice(&message.payload) {
            Ok(outcome) => outcome,
            Err(error) => {
                tracing::error!(%worker, %error, "what a worker sent as an outcome is none; it is left out");
                return AckKind::Term;
            }
        };
        let unit = outcome.lease.unit;
        let Some(grant) = of_its_order(&outcome, &self.remote.key) else {
            tracing::error!(%unit, %worker, "a worker sent an outcome without the order that it is of; it is left out");
            return AckKind::Ack;
        };
        if !outcome.lease.slot.starts_with(&names::slot(&worker, "")) {
            outcome.lease.slot = names::slot(&worker, "?");
        }
        let (workers, now) = (self.server.store.workers(), self.server.clock.now());
        if workers.ban_of(worker.as_str()).is_some() {
            tracing::warn!(%unit, %worker, "the worker is banned: what came of it is left out");
            return AckKind::Ack;
        }
        let nonce = outcome.lease.nonce;
        // Who has not begun it, or somebody else has: whatever it is, it is not this worker's.
        let is_over = match self.server.store.lease_holder(unit, nonce).await {
            Ok(Some(holder)) if WorkerName::of_holder(&holder).as_ref() != Some(&worker) => {
                tracing::warn!(%unit, %worker, holder, "the order is not this worker's; what came of it is left out");
                return AckKind::Ack;
            }
            Ok(holder) => holder.is_none(),
            Err(error) => {
                tracing::error!(%unit, %worker, %error, "the queue cannot be asked whose an outcome is; trying again");
                return AckKind::Nak(Some(AGAIN));
            }
        };
        if grant.program != self.remote.like.program
            && matches!(outcome.outcome, Outcome::Done { .. })
        {
            tracing::info!(%unit, %worker, "played by another program than this one: it is played again");
            outcome.outcome = Outcome::Shutdown;
        }
        if let Outcome::PlatformFault { reason } = &mut outcome.outcome {
            *reason = harmless(reason).chars().take(REASON_SHOWN).collect();
        }
        let failed = matches!(outcome.outcome, Outcome::PlatformFault { .. });
        let was_played = matches!(outcome.outcome, Outcome::Done { .. });
        let fails = || {
            if let Some((units, until)) = workers.failed(worker.as_str(), unit, now) {
                tracing::warn!(%worker, units, %until, "a worker could play none of its last units; it rests");
            }
        };
        let _here = self.handed_in.take(nonce);
        let acknowledgement = match self.stored(message, grant, outcome).await {
            // Whoever sends it once more has done nothing by that.
            Ok(Taken::Held | Taken::Unusable) if is_over => {
                tracing::info!(%unit, %worker, "over already; what came of it is left out");
                AckKind::Ack
            }
            Ok(Taken::Held) => {
                workers.ended(unit);
                if was_played {
                    workers.played(worker.as_str());
                }
                if failed {
                    fails();
                }
                tracing::info!(%unit, %worker, "taken in");
                AckKind::Ack
            }
            Ok(Taken::Unusable) => {
                workers.ended(unit);
                fails();
                tracing::info!(%unit, %worker, "given back: what came of it cannot count");
                AckKind::Ack
            }
            Ok(Taken::Lost) => {
                tracing::info!(%unit, %worker, "no longer this worker's; what came of it is left out");
                AckKind::Ack
            }
            Ok(Taken::Disbelieved(difference)) => match self.ban(&worker, &difference).await {
                again @ AckKind::Nak(_) => return again,
                banned => banned,
            },
            Ok(Taken::StillComing) => return AckKind::Nak(Some(SOON)),
            Err(error) => {
                tracing::error!(%unit, %worker, cause = format!("{error:#}"), "what came of a unit cannot be stored; trying again");
                return AckKind::Nak(Some(AGAIN));
            }
        };
        // What comes again, above, is kept until it is taken.
        self.handed_in.forget(nonce);
        workers.forget_files(nonce);
        acknowledgement
    }

    /// Checks and stores an outcome. Meanwhile its unit is held, since its worker has done its part, and NATS hears that it is worked at.
    async fn stored(
        &self,
        message: &jetstream::Message,
        grant: Grant,
        outcome: RemoteOutcome,
    ) -> anyhow::Result<Taken> {
        let (server, checks, lease) = (
            self.server.clone(),
            self.remote.checks(),
            outcome.lease.clone(),
        );
        let (done, bucket) = (grant.episodes(), self.bucket.clone());
        let mut storing = tokio::spawn(async move {
            let bucket = bucket.filter(|_| matches!(outcome.outcome, Outcome::Done { .. }));
            if let Some(bucket) = &bucket
                && server.store.is_held(grant.unit, grant.nonce).await?
            {
                bucket.take(&grant, server.store.artifacts()).await?;
            }
            let of = grant.clone();
            let stored = tokio::task::spawn_blocking(move || store(&server, &checks, &of, outcome))
                .await??;
            if let Some(bucket) = &bucket {
                bucket.forget(&grant).await;
            }
            anyhow::Ok(stored)
        });
        let every = self.server.renews_every(&lease);
        loop {
            tokio::select! {
                stored = &mut storing => return stored.map_err(anyhow::Error::from).flatten(),
                () = tokio::time::sleep(every) => {}
            }
            let server = self.server.clone();
            let held = lease.clone();
            let renewed = tokio::task::spawn_blocking(move || server.renew(&held, done)).await;
            if let Err(error) = renewed.map_err(anyhow::Error::from).flatten() {
                tracing::warn!(unit = %lease.unit, cause = format!("{error:#}"), "what is being checked could not be renewed");
            }
            // Who is not told so in time delivers it once more, which changes nothing.
            let _ = message.ack_with(AckKind::Progress).await;
        }
    }

    /// Nothing is taken of a worker any more; what it had is given to others.
    async fn ban(&self, worker: &WorkerName, difference: &str) -> AckKind {
        let reason = format!("what it recorded is not what the simulator gives: {difference}");
        let (store, now) = (&self.server.store, self.server.clock.now());
        match store.ban_worker(Actor::Server, worker, &reason, now).await {
            Ok(again) => {
                tracing::error!(
                    %worker,
                    difference,
                    again,
                    "a worker is banned: what it recorded is not what the simulator gives"
                );
                AckKind::Ack
            }
            // Two of its outcomes at once.
            Err(StoreError::Conflict(_)) => AckKind::Ack,
            Err(error) => {
                tracing::error!(%worker, %error, difference, "a worker that is not to be believed cannot be banned; trying again");
                AckKind::Nak(Some(AGAIN))
            }
        }
    }
}

/// What comes of what was spawned.
fn taken(done: Option<Result<anyhow::Result<()>, JoinError>>) -> anyhow::Result<()> {
    done.map_or(Ok(()), |done| done?)
}
