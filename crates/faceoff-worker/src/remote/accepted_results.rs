//! Accepts results of remote workers after checking them. Results arrive as messages of NATS, a message broker, which
//! delivers a message again until it is acknowledged.

use super::{
    dispatch::{Dispatcher, POLL_INTERVAL},
    grants::{Acceptance, open_grant, store_result},
    names,
    pending_results::PendingResult,
    unfinished_checks::CheckStart,
};
use crate::server::{JobServer, LeaseStatus, ReleaseReason};
use anyhow::Context as _;
use async_nats::jetstream::{self, AckKind};
use faceoff_store::{Actor, StoreError};
use faceoff_types::WorkerName;
use faceoff_types::printable_excerpt;
use faceoff_wire::{
    grant::Grant,
    remote::{RemoteJobEnd, ResultMessage},
};
use futures::StreamExt as _;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use tokio::task::{JoinError, JoinSet};
use tokio_util::sync::CancellationToken;

/// Delay before a result that could not be stored is delivered again.
const RETRY_AFTER: Duration = Duration::from_secs(5);
/// Delay before a result whose files are still being uploaded is delivered again.
const FILES_RETRY_AFTER: Duration = Duration::from_secs(1);
/// Maximum number of results checked at a time; each check occupies a thread.
const MAX_CONCURRENT_CHECKS: usize = 2;
/// Maximum number of pending results looked up in the stream at a time, since each lookup reads the whole message.
const MAX_LOOKUPS: usize = 16;
/// Maximum length of a worker's description of a platform fault, in characters.
const MAX_REASON_CHARS: usize = 500;

/// Longest time without any answer of NATS. The client itself may wait forever for an answer that was lost with a connection.
const NATS_TIMEOUT: Duration = Duration::from_secs(30);

/// Waits for an answer of NATS, for at most [`NATS_TIMEOUT`]. NATS itself ends a fetch without results after [`POLL_INTERVAL`].
///
/// # Errors
/// If there is none in time.
async fn with_nats_timeout<T>(answer: impl Future<Output = T>) -> anyhow::Result<T> {
    let answer = tokio::time::timeout(NATS_TIMEOUT, answer).await;
    answer.context("NATS has not answered in time while results were fetched")
}

impl Dispatcher {
    /// Accepts results until the shutdown.
    pub(super) async fn accept_results(
        self: &Arc<Self>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let mut checks = JoinSet::new();
        let mut result = self.fetch_results(&mut checks, shutdown).await;
        // Running checks are completed even if no more results can be fetched.
        while let Some(done) = checks.join_next().await {
            result = result.and(join_result(Some(done)));
        }
        result
    }

    /// Fetches results and starts their checks. It fetches no more results than can be checked at once: NATS would deliver a
    /// waiting result again after a while.
    async fn fetch_results(
        self: &Arc<Self>,
        checks: &mut JoinSet<anyhow::Result<()>>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let mut consumer = self.streams.results().await?;
        let mut undelivered = None;
        while !shutdown.is_cancelled() {
            while checks.len() >= MAX_CONCURRENT_CHECKS {
                join_result(checks.join_next().await)?;
            }
            let results = consumer
                .batch()
                .max_messages(MAX_CONCURRENT_CHECKS - checks.len())
                .expires(POLL_INTERVAL)
                .messages();
            let mut results = with_nats_timeout(results)
                .await?
                .context("fetching results")?;
            let mut is_empty = true;
            while let Some(message) = with_nats_timeout(results.next()).await? {
                is_empty = false;
                let message = message.map_err(|error| anyhow::anyhow!(error))?;
                let dispatcher = Arc::clone(self);
                checks.spawn(async move {
                    let acknowledgement = dispatcher.accept(&message).await;
                    let acknowledged = message.ack_with(acknowledgement).await;
                    acknowledged.map_err(|error| anyhow::anyhow!(error))
                });
            }
            while let Some(done) = checks.try_join_next() {
                join_result(Some(done))?;
            }
            if is_empty {
                let checked = self.streams.check_results(&mut consumer, &mut undelivered);
                with_nats_timeout(checked).await??;
            }
        }
        Ok(())
    }

    /// Renews the leases of pending results, since their slots run other jobs. A job whose result NATS has lost is released.
    pub(super) async fn renew_pending_results(
        &self,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let interval = Duration::from_secs(self.server.lease_s.into()) / 3;
        while !shutdown.is_cancelled() {
            let mut due_for_renewal = self.pending_results.due_for_renewal(Instant::now());
            for PendingResult {
                lease,
                episodes_done,
                ..
            } in due_for_renewal.clone()
            {
                let (server, nonce) = (self.server.clone(), lease.nonce);
                let renewed =
                    tokio::task::spawn_blocking(move || server.renew(&lease, episodes_done));
                if renewed.await?? == LeaseStatus::Lost {
                    self.pending_results.remove(nonce);
                }
            }
            // NATS loses results in order, so checking the oldest ones suffices.
            due_for_renewal.sort_by_key(|result| result.since);
            due_for_renewal.truncate(MAX_LOOKUPS);
            for PendingResult {
                lease, sequence, ..
            } in due_for_renewal
            {
                let is_stored = self.streams.has_result(&lease, sequence).await?;
                // A result that is being processed, or was accepted meanwhile, is not lost.
                if is_stored || self.pending_results.is_processing_or_processed(lease.nonce) {
                    continue;
                }
                self.pending_results.remove(lease.nonce);
                self.unfinished_checks.finish(lease.nonce);
                tracing::warn!(job = %lease.job_id, slot = lease.holder, "NATS has lost a result: the job is queued again");
                let server = self.server.clone();
                let released = tokio::task::spawn_blocking(move || {
                    server.release(&lease, ReleaseReason::Interrupted)
                });
                released.await??;
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = tokio::time::sleep(interval) => {}
            }
        }
        Ok(())
    }

    /// Checks and stores a result, and returns how to acknowledge its message: `Ack` if it is dealt with, `Term` if it is useless,
    /// `Nak` to get it again after a delay.
    async fn accept(&self, message: &jetstream::Message) -> AckKind {
        let Some(worker) = names::worker_of(&message.subject) else {
            tracing::error!(subject = %message.subject, "a result from an unknown worker; ignored");
            return AckKind::Term;
        };
        let mut result: ResultMessage = match serde_json::from_slice(&message.payload) {
            Ok(result) => result,
            Err(error) => {
                tracing::error!(%worker, %error, "a worker sent an unreadable result; ignored");
                return AckKind::Term;
            }
        };
        let id = result.lease.job_id;
        let Some(grant) = open_grant(&result, &self.remote.key) else {
            tracing::error!(job = %id, %worker, "a worker sent a result without a valid grant; ignored");
            return AckKind::Ack;
        };
        if !result.lease.holder.starts_with(&worker.slot_holder("")) {
            // The subject of the message names the worker; its slot is unknown.
            result.lease.holder = worker.slot_holder("?");
        }
        let (workers, now) = (&self.server.live.workers, self.server.clock.now());
        match self.server.store.ban_reason(&worker).await {
            Ok(None) => {}
            Ok(Some(_)) => {
                tracing::warn!(job = %id, %worker, "the worker is banned; result ignored");
                self.unfinished_checks.finish(result.lease.nonce);
                return AckKind::Ack;
            }
            Err(error) => {
                tracing::error!(job = %id, %worker, %error, "the bans could not be read for a result; trying again");
                return AckKind::Nak(Some(RETRY_AFTER));
            }
        }
        let nonce = result.lease.nonce;
        // Only the worker that started the job may send its result.
        let is_job_over = match self.server.store.lease_holder(id, nonce).await {
            Ok(Some(holder)) if WorkerName::from_holder(&holder).as_ref() != Some(&worker) => {
                tracing::warn!(job = %id, %worker, holder, "the worker does not have the lease; result ignored");
                self.unfinished_checks.finish(nonce);
                return AckKind::Ack;
            }
            Ok(holder) => holder.is_none(),
            Err(error) => {
                tracing::error!(job = %id, %worker, %error, "the lease of a result could not be read; trying again");
                return AckKind::Nak(Some(RETRY_AFTER));
            }
        };
        if grant.program_blake3 != self.remote.required.program_blake3
            && matches!(result.end, RemoteJobEnd::Done { .. })
        {
            tracing::info!(job = %id, %worker, "the result is from another program version: the job is queued again");
            result.end = RemoteJobEnd::Interrupted;
        }
        if let RemoteJobEnd::PlatformFault { reason } = &mut result.end {
            *reason = printable_excerpt(reason, MAX_REASON_CHARS);
        }
        let has_failed = matches!(result.end, RemoteJobEnd::PlatformFault { .. });
        let is_done = matches!(result.end, RemoteJobEnd::Done { .. });
        let record_failure = || {
            if let Some((jobs, until)) = workers.record_failure(worker.as_str(), id, now) {
                tracing::warn!(%worker, jobs, %until, "all recent jobs of a worker failed; it gets none for a while");
            }
        };
        // Marks the result as being processed until the end of this function.
        let _processing = self.pending_results.start_processing(nonce);
        let acknowledgement = match self.check_within_limit(message, grant, result).await {
            // A repeated result has no effect.
            Ok(Acceptance::Accepted | Acceptance::JobMismatch) if is_job_over => {
                tracing::info!(job = %id, %worker, "the job is over already; result ignored");
                AckKind::Ack
            }
            Ok(Acceptance::Accepted) => {
                workers.end_job(id);
                if is_done {
                    workers.record_success(worker.as_str());
                }
                if has_failed {
                    record_failure();
                }
                tracing::info!(job = %id, %worker, "result accepted");
                AckKind::Ack
            }
            Ok(Acceptance::JobMismatch) => {
                workers.end_job(id);
                record_failure();
                tracing::info!(job = %id, %worker, "result not acceptable: the job is queued again");
                AckKind::Ack
            }
            Ok(Acceptance::LeaseLost) => {
                tracing::info!(job = %id, %worker, "lease lost; result ignored");
                AckKind::Ack
            }
            Ok(Acceptance::SimulationMismatch(difference)) => {
                // The text may quote the recording, which the worker wrote.
                let difference = printable_excerpt(&difference, MAX_REASON_CHARS);
                let reason = format!("its recording differs from the simulation: {difference}");
                match self.ban(&worker, &reason).await {
                    retry @ AckKind::Nak(_) => return retry,
                    acknowledgement => acknowledgement,
                }
            }
            Ok(Acceptance::Unchecked) => {
                let reason = format!(
                    "three checks of the worker's result of job {id} crashed or ended with the server; if the server was stopped \
                     each time for another reason, readmit the worker"
                );
                match self.ban(&worker, &reason).await {
                    retry @ AckKind::Nak(_) => return retry,
                    acknowledgement => acknowledgement,
                }
            }
            Ok(Acceptance::FilesPending) => return AckKind::Nak(Some(FILES_RETRY_AFTER)),
            Err(error) => {
                tracing::error!(job = %id, %worker, cause = format!("{error:#}"), "a result could not be stored; trying again");
                return AckKind::Nak(Some(RETRY_AFTER));
            }
        };
        self.unfinished_checks.finish(nonce);
        // Results that are delivered again (the early returns above) stay pending.
        self.pending_results.remove(nonce);
        workers.forget_files(nonce);
        acknowledgement
    }

    /// Checks and stores a result, unless too many earlier checks of it did not end: they ended the process, or panicked.
    async fn check_within_limit(
        &self,
        message: &jetstream::Message,
        grant: Grant,
        result: ResultMessage,
    ) -> anyhow::Result<Acceptance> {
        let nonce = result.lease.nonce;
        if self.unfinished_checks.begin(nonce)? == CheckStart::Refused {
            return Ok(Acceptance::Unchecked);
        }
        let checked = self.check_and_store(message, grant, result).await;
        let is_panic = |error: &anyhow::Error| {
            let join_error = error.downcast_ref::<JoinError>();
            join_error.is_some_and(JoinError::is_panic)
        };
        if !checked.as_ref().is_err_and(is_panic) {
            self.unfinished_checks.finish(nonce);
        }
        checked
    }

    /// Checks and stores a result. Meanwhile its lease is renewed, and NATS gets notices that the message is being processed.
    async fn check_and_store(
        &self,
        message: &jetstream::Message,
        grant: Grant,
        result: ResultMessage,
    ) -> anyhow::Result<Acceptance> {
        let (server, checks, lease) = (
            self.server.clone(),
            self.remote.checks(self.server.simulator.clone()),
            result.lease.clone(),
        );
        let (episodes_done, bucket) = (grant.episodes(), self.bucket.clone());
        let mut storing = tokio::spawn(async move {
            let bucket = bucket.filter(|_| matches!(result.end, RemoteJobEnd::Done { .. }));
            if let Some(bucket) = &bucket
                && server.store.is_leased(grant.job_id, grant.nonce).await?
            {
                bucket.fetch_files(&grant, server.store.artifacts()).await?;
            }
            let job_grant = grant.clone();
            let stored = tokio::task::spawn_blocking(move || {
                store_result(&server, &checks, &job_grant, result)
            })
            .await??;
            if let Some(bucket) = &bucket {
                bucket.delete_files(&grant).await;
            }
            anyhow::Ok(stored)
        });
        let interval = self.server.renewal_interval(&lease);
        loop {
            tokio::select! {
                stored = &mut storing => return stored.map_err(anyhow::Error::from).flatten(),
                () = tokio::time::sleep(interval) => {}
            }
            let server = self.server.clone();
            let lease_copy = lease.clone();
            let renewed =
                tokio::task::spawn_blocking(move || server.renew(&lease_copy, episodes_done)).await;
            if let Err(error) = renewed.map_err(anyhow::Error::from).flatten() {
                tracing::warn!(job = %lease.job_id, cause = format!("{error:#}"), "the lease of a result under check could not be renewed");
            }
            // If this notice fails, NATS delivers the message again, which has no effect.
            let _ = message.ack_with(AckKind::Progress).await;
        }
    }

    /// Bans a worker: its results are ignored, and its jobs are queued again. Returns how to acknowledge the message.
    async fn ban(&self, worker: &WorkerName, reason: &str) -> AckKind {
        let (store, now) = (&self.server.store, self.server.clock.now());
        match store.ban_worker(Actor::Server, worker, reason, now).await {
            Ok(requeued) => {
                self.server.live.workers.end_jobs_of(worker.as_str());
                tracing::error!(%worker, reason, requeued, "a worker is banned");
                AckKind::Ack
            }
            // Another result of this worker has caused the ban at the same time.
            Err(StoreError::Conflict(_)) => AckKind::Ack,
            Err(error) => {
                tracing::error!(%worker, %error, reason, "a worker could not be banned; trying again");
                AckKind::Nak(Some(RETRY_AFTER))
            }
        }
    }
}

/// The result of a check task; `None`, if there was no task, is no error.
fn join_result(done: Option<Result<anyhow::Result<()>, JoinError>>) -> anyhow::Result<()> {
    done.map_or(Ok(()), |done| done?)
}
