//! Answers requests of remote workers, and forwards their live updates of games.

use super::{
    compatibility::incompatibility,
    names::{self, ALL, NOT_STARTED, Names},
    pending_results::PendingResults,
    published_jobs::PublishedJobs,
    streams::Streams,
};
use crate::{game_broadcast::show_update, local::to_claim};
use async_nats::{Client, Message};
use faceoff_live::{LiveState, SlotReport, WorkerInfo};
use faceoff_store::{Store, StoreError};
use faceoff_types::{Clock, WorkerName, printable_excerpt};
use faceoff_wire::{
    job::Lease,
    remote::{LiveGameMessage, LiveGameUpdate, WorkerCapabilities, WorkerRequest, WorkerResponse},
};
use futures::StreamExt as _;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

/// Answers requests until the shutdown.
pub(super) struct RequestHandler {
    pub(super) client: Client,
    pub(super) names: Names,
    pub(super) store: Store,
    pub(super) live: LiveState,
    pub(super) clock: Clock,
    pub(super) lease_s: u32,
    /// Program and runtimes that workers must have.
    pub(super) required: WorkerCapabilities,
    pub(super) published_jobs: Arc<PublishedJobs>,
    pub(super) pending_results: Arc<PendingResults>,
    pub(super) streams: Arc<Streams>,
}

/// Maximum number of requests handled at a time.
const MAX_CONCURRENT: usize = 64;

/// Maximum length of a worker's problem description, in characters.
const MAX_PROBLEM_CHARS: usize = 300;
/// Maximum length of the reason why a worker gets no jobs, in characters.
const MAX_REFUSAL_CHARS: usize = 1000;
/// Maximum length of a worker's program version, in characters.
const MAX_VERSION_CHARS: usize = 40;

/// Minimum interval between writes of progress, since each is a transaction that waits for the disk.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(2);

/// The last renewal of each lease (identified by its nonce) in the database: its time and the number of finished episodes.
/// Workers renew more often than the database needs to know.
#[derive(Debug, Default)]
struct Renewals(Mutex<HashMap<Uuid, (Instant, u32)>>);

impl Renewals {
    /// Must this renewal be written? Yes, if the lease is new, if there is progress, or if the last write is `interval` ago.
    fn is_due(&self, nonce: Uuid, episodes_done: u32, interval: Duration, now: Instant) -> bool {
        let writes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        writes
            .get(&nonce)
            .is_none_or(|(written_at, written_episodes)| {
                let elapsed = now.duration_since(*written_at);
                elapsed >= interval
                    || (*written_episodes != episodes_done && elapsed >= PROGRESS_INTERVAL)
            })
    }

    /// Records a write. Entries of old leases are removed.
    fn record_write(&self, nonce: Uuid, episodes_done: u32, interval: Duration, now: Instant) {
        let mut writes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if writes.insert(nonce, (now, episodes_done)).is_none() {
            writes.retain(|_, (written_at, _)| now.duration_since(*written_at) < 10 * interval);
        }
    }
}

impl RequestHandler {
    pub(super) async fn run(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let requests = self.client.subscribe(self.names.requests(ALL)).await?;
        let renewals = Renewals::default();
        // Requests are handled concurrently, so that none waits for another's database write.
        requests
            .take_until(shutdown.cancelled())
            .for_each_concurrent(MAX_CONCURRENT, |request| self.reply_to(request, &renewals))
            .await;
        anyhow::ensure!(shutdown.is_cancelled(), "the connection to NATS has ended");
        Ok(())
    }

    async fn reply_to(&self, message: Message, renewals: &Renewals) {
        let Some(reply) = message.reply.clone() else {
            return;
        };
        // If another server owns the streams, the worker belongs to that server.
        if !self.streams.are_owned() {
            return;
        }
        // A worker may name any subject for the reply, and this server has the right to publish to most subjects.
        let worker = names::worker_of(&message.subject);
        if !worker.is_some_and(|worker| self.names.is_inbox_of(&worker, &reply)) {
            tracing::warn!(subject = %message.subject, %reply, "a worker requested a reply on a foreign subject; not answered");
            return;
        }
        let response = self.response_to(&message, renewals).await;
        let sent = async {
            let response = serde_json::to_vec(&response)?;
            anyhow::Ok(self.client.publish(reply, response.into()).await?)
        };
        if let Err(error) = sent.await {
            // The worker will ask again.
            tracing::debug!(%error, "a worker's request could not be answered");
        }
    }

    async fn response_to(&self, message: &Message, renewals: &Renewals) -> WorkerResponse {
        let refused = |reason: &str| WorkerResponse::Refused {
            reason: reason.to_owned(),
        };
        let Some(worker) = names::worker_of(&message.subject) else {
            return refused("the subject does not name a worker");
        };
        let request: WorkerRequest = match serde_json::from_slice(&message.payload) {
            Ok(request) => request,
            Err(error) => {
                tracing::warn!(%worker, %error, "a worker sent an unknown request");
                return refused(&format!("the server does not know this request: {error}"));
            }
        };
        let ban = match self.store.ban_reason(&worker).await {
            Ok(ban) => ban,
            Err(error) => return unavailable_response(&worker, &error),
        };
        let ban =
            ban.map(|reason| format!("the server accepts no results of this worker: {reason}"));
        if let (
            WorkerRequest::StartJob { .. }
            | WorkerRequest::RenewLease { .. }
            | WorkerRequest::ResultPending { .. },
            Some(reason),
        ) = (&request, &ban)
        {
            return refused(reason);
        }
        let now = self.clock.now();
        let backoff = || self.live.workers.backoff_reason(worker.as_str(), now);
        let result = match request {
            WorkerRequest::Register(capabilities) => {
                let reason = ban
                    .or_else(|| incompatibility(&capabilities, &self.required))
                    .or_else(backoff)
                    // The reason may quote the worker's runtimes, which come from outside.
                    .map(|reason| printable_excerpt(&reason, MAX_REFUSAL_CHARS));
                let info = worker_info(&capabilities);
                let workers = &self.live.workers;
                workers.record_poll(worker.as_str(), info, reason.as_deref(), now);
                return response_for(reason);
            }
            WorkerRequest::CheckRegistration(capabilities) => {
                return response_for(
                    ban.or_else(|| incompatibility(&capabilities, &self.required))
                        .or_else(backoff),
                );
            }
            WorkerRequest::StartJob { lease, slot } if names::is_subject_token(&slot) => {
                if let Some(reason) = backoff() {
                    return refused(&reason);
                }
                self.start_job(&worker, &lease, &slot).await
            }
            WorkerRequest::StartJob { .. } => return refused("the slot's name is invalid"),
            WorkerRequest::RenewLease {
                lease,
                episodes_done,
                send_problem,
            } => {
                let send_problem =
                    send_problem.map(|problem| printable_excerpt(&problem, MAX_PROBLEM_CHARS));
                let held = self.renew(&worker, &lease, episodes_done, renewals).await;
                self.record_renewal(&worker, &lease, held, send_problem.as_deref())
            }
            WorkerRequest::ResultPending {
                lease,
                episodes_done,
                sequence,
            } => {
                let held = self
                    .store
                    .is_leased_by(&worker, lease.job_id, lease.nonce)
                    .await;
                if matches!(held, Ok(true)) {
                    let now = Instant::now();
                    self.pending_results
                        .add(lease, episodes_done, sequence, now);
                }
                held
            }
        };
        match result {
            Ok(true) => WorkerResponse::Accepted,
            Ok(false) => refused("this worker does not have the lease"),
            Err(error) => unavailable_response(&worker, &error),
        }
    }

    /// Transfers the lease of a published job to the worker's slot.
    async fn start_job(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        slot: &str,
    ) -> Result<bool, StoreError> {
        let claim = to_claim(lease, NOT_STARTED);
        let now = self.clock.now();
        let holder = worker.slot_holder(slot);
        let is_started = self
            .store
            .transfer_lease(&claim, &holder, self.lease_s, now)
            .await?;
        if is_started {
            let published = self.published_jobs.take(lease.nonce);
            let description = published.map(|job| job.description);
            let report = SlotReport {
                description: description.as_deref(),
                problem: None,
            };
            let workers = &self.live.workers;
            workers.record_job(worker.as_str(), slot, lease.job_id, report, now);
        }
        Ok(is_started)
    }

    /// Renews a lease if this worker holds it, and returns whether it does. Not every renewal is written to the database ([`Renewals`]).
    async fn renew(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        episodes_done: u32,
        renewals: &Renewals,
    ) -> Result<bool, StoreError> {
        let interval = Duration::from_secs(self.lease_s.into()) / 3;
        if !self
            .store
            .is_leased_by(worker, lease.job_id, lease.nonce)
            .await?
        {
            return Ok(false);
        }
        if !renewals.is_due(lease.nonce, episodes_done, interval, Instant::now()) {
            return Ok(true);
        }
        // The lease's holder, which the worker wrote, becomes the actor of the write. If it is none of the worker's slots, the actor is
        // the worker itself.
        let is_own_slot = lease.holder.starts_with(&worker.slot_holder(""));
        let claim = to_claim(
            lease,
            if is_own_slot {
                &lease.holder
            } else {
                worker.as_str()
            },
        );
        let now = self.clock.now();
        let renewed = self
            .store
            .heartbeat(&claim, episodes_done, self.lease_s, now);
        let held = renewed.await?;
        if held {
            renewals.record_write(lease.nonce, episodes_done, interval, Instant::now());
        }
        Ok(held)
    }

    /// Updates the state of the slot that organisers see. `held` is the result of the renewal, which is returned unchanged.
    fn record_renewal(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        held: Result<bool, StoreError>,
        send_problem: Option<&str>,
    ) -> Result<bool, StoreError> {
        let workers = &self.live.workers;
        match (&held, lease.holder.strip_prefix(&worker.slot_holder(""))) {
            (Ok(true), Some(slot)) => {
                let report = SlotReport {
                    description: None,
                    problem: send_problem,
                };
                workers.record_job(
                    worker.as_str(),
                    slot,
                    lease.job_id,
                    report,
                    self.clock.now(),
                );
            }
            (Ok(false), _) => workers.end_job(lease.job_id),
            _ => {}
        }
        held
    }

    /// Forwards live updates of games from remote workers to viewers.
    pub(super) async fn forward_live_games(
        &self,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<()> {
        let mut updates = self.client.subscribe(self.names.live_games(ALL)).await?;
        let mut events = LiveEventBytes::default();
        loop {
            let message = tokio::select! {
                () = shutdown.cancelled() => return Ok(()),
                message = updates.next() => message,
            };
            let message =
                message.ok_or_else(|| anyhow::anyhow!("the connection to NATS has ended"))?;
            let Ok(update) = serde_json::from_slice::<LiveGameMessage>(&message.payload) else {
                continue;
            };
            // Only the holder of a lease may send updates, of its own game.
            let Some(worker) = names::worker_of(&message.subject) else {
                continue;
            };
            let (job_id, nonce) = (update.lease.job_id, update.lease.nonce);
            let has_lease = self.store.is_leased_by(&worker, job_id, nonce).await;
            if !self.streams.are_owned()
                || !has_lease.unwrap_or_default()
                || self.store.game_of_job(job_id).await.ok().flatten() != Some(update.game)
            {
                continue;
            }
            let has_events = matches!(
                &update.update,
                LiveGameUpdate::Progress { events, .. } if !events.is_empty()
            );
            if !has_events || events.is_allowed(nonce, message.payload.len()) {
                let attempt = (update.game, update.attempt);
                show_update(&self.live.games, attempt, update.update);
            }
        }
    }
}

/// Bytes of the messages with events that were forwarded, by the nonce of their lease. Events are kept in memory as long as their game.
#[derive(Debug, Default)]
struct LiveEventBytes(HashMap<Uuid, usize>);

impl LiveEventBytes {
    /// Maximum number of bytes per lease: far more than the events of any game.
    const MAX: usize = 4 << 20;
    /// Maximum number of leases with a count, far more than there are slots. Beyond it, all counts begin again.
    const MAX_LEASES: usize = 10_000;

    /// Counts a message; false if its lease has sent too much.
    fn is_allowed(&mut self, nonce: Uuid, bytes: usize) -> bool {
        if self.0.len() >= Self::MAX_LEASES && !self.0.contains_key(&nonce) {
            self.0.clear();
        }
        let sent = self.0.entry(nonce).or_default();
        *sent = sent.saturating_add(bytes);
        *sent <= Self::MAX
    }
}

/// The response if the database cannot be read.
fn unavailable_response(worker: &WorkerName, error: &StoreError) -> WorkerResponse {
    tracing::warn!(%worker, %error, "the database could not be read for a worker's request");
    WorkerResponse::Unavailable
}

fn response_for(reason: Option<String>) -> WorkerResponse {
    match reason {
        Some(reason) => WorkerResponse::Refused { reason },
        None => WorkerResponse::Accepted,
    }
}

/// The description of a worker for organisers, with a limited number of labels.
fn worker_info(capabilities: &WorkerCapabilities) -> WorkerInfo {
    let labels = capabilities
        .labels
        .iter()
        .take(WorkerCapabilities::MAX_LABELS);
    WorkerInfo {
        version: printable_excerpt(&capabilities.version, MAX_VERSION_CHARS),
        slots: capabilities.slots,
        labels: labels
            .map(|label| printable_excerpt(label, WorkerCapabilities::MAX_LABEL_CHARS))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_of_a_lease_are_bounded() {
        let mut events = LiveEventBytes::default();
        let [first, second] = [1, 2].map(Uuid::from_u128);
        assert!(events.is_allowed(first, LiveEventBytes::MAX));
        assert!(!events.is_allowed(first, 1));
        assert!(events.is_allowed(second, 1));
        for nonce in 3..=LiveEventBytes::MAX_LEASES as u128 + 2 {
            assert!(events.is_allowed(Uuid::from_u128(nonce), 1));
        }
        assert!(events.0.len() <= LiveEventBytes::MAX_LEASES);
    }

    #[test]
    fn renewals_are_written_after_progress_or_time() {
        let renewals = Renewals::default();
        let (nonce, start, interval) =
            (Uuid::from_u128(1), Instant::now(), Duration::from_secs(10));
        let is_due = |episodes_done, after_s| {
            let now = start + Duration::from_secs(after_s);
            let is_due = renewals.is_due(nonce, episodes_done, interval, now);
            if is_due {
                renewals.record_write(nonce, episodes_done, interval, now);
            }
            is_due
        };
        assert!(is_due(0, 0));
        assert!(!is_due(0, 1));
        assert!(
            !is_due(1, 1),
            "one episode more, but soon after the last write"
        );
        assert!(is_due(1, 2), "one episode more");
        assert!(!is_due(1, 11));
        assert!(is_due(1, 12));
    }
}
