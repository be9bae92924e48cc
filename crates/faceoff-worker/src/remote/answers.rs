//! What workers elsewhere ask the server, and are answered at once.

use super::{
    handed_in::AllHandedIn,
    like::differs,
    names::{self, ALL, Names, WAITING},
    streams::Streams,
    taken_back::AllGivenOut,
};
use async_nats::{Client, Message};
use faceoff_store::{Claim, Store, StoreError, WorkTold, WorkerAbout, WorkerName};
use faceoff_types::{Clock, harmless};
use faceoff_wire::{
    remote::{Answer, Ask, Introduction, RemoteShow, Shown},
    work::Lease,
};
use futures::StreamExt as _;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

/// Answers until the shutdown.
pub(super) struct Answers {
    pub(super) client: Client,
    pub(super) names: Names,
    pub(super) store: Store,
    pub(super) clock: Clock,
    pub(super) lease_s: u32,
    /// What workers must be like.
    pub(super) like: Introduction,
    pub(super) given_out: Arc<AllGivenOut>,
    pub(super) handed_in: Arc<AllHandedIn>,
    pub(super) streams: Arc<Streams>,
}

/// So many are answered at the same time.
const AT_ONCE: usize = 64;

/// So much is shown of what keeps a worker from handing in, in characters.
const TROUBLE_SHOWN: usize = 300;

/// How often progress is written: each time is a transaction that waits for the disk.
const PROGRESS_EVERY: Duration = Duration::from_secs(2);

/// When leases were last written as renewed, and how far the work was: workers ask more often than the database needs to know.
#[derive(Debug, Default)]
struct Renewals(Mutex<HashMap<Uuid, (Instant, u32)>>);

impl Renewals {
    /// Is it to be written, because it is new, has progressed since a while, or was written so long ago?
    fn is_due(&self, nonce: Uuid, done: u32, every: Duration, now: Instant) -> bool {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.get(&nonce).is_none_or(|(at, before)| {
            let ago = now.duration_since(*at);
            ago >= every || (*before != done && ago >= PROGRESS_EVERY)
        })
    }

    /// It was written. What was not for so long is forgotten: nobody asks about it any more.
    fn written(&self, nonce: Uuid, done: u32, every: Duration, now: Instant) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.insert(nonce, (now, done)).is_none() {
            all.retain(|_, (at, _)| now.duration_since(*at) < 10 * every);
        }
    }
}

impl Answers {
    pub(super) async fn answer(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let asks = self.client.subscribe(self.names.asks(ALL)).await?;
        let renewals = Renewals::default();
        // Nobody waits for another's write to the database.
        asks.take_until(shutdown.cancelled())
            .for_each_concurrent(AT_ONCE, |asked| self.reply_to(asked, &renewals))
            .await;
        anyhow::ensure!(shutdown.is_cancelled(), "the connection to NATS has ended");
        Ok(())
    }

    async fn reply_to(&self, asked: Message, renewals: &Renewals) {
        let Some(reply) = asked.reply.clone() else {
            return;
        };
        // While another server's streams are there it is another server's worker.
        if !self.streams.are_ours() {
            return;
        }
        // NATS lets a worker name any subject here, and would let this server publish to most of them.
        let worker = names::worker_of(&asked.subject);
        if !worker.is_some_and(|worker| self.names.is_inbox_of(&worker, &reply)) {
            tracing::warn!(subject = %asked.subject, %reply, "a worker asks for an answer somewhere else than with itself; it gets none");
            return;
        }
        let answer = self.answer_to(&asked, renewals).await;
        let sent = async {
            let answer = serde_json::to_vec(&answer)?;
            anyhow::Ok(self.client.publish(reply, answer.into()).await?)
        };
        if let Err(error) = sent.await {
            // Who was not answered asks again.
            tracing::debug!(%error, "a worker was not answered");
        }
    }

    async fn answer_to(&self, asked: &Message, renewals: &Renewals) -> Answer {
        let no = |reason: &str| Answer::No {
            reason: reason.to_owned(),
        };
        let Some(worker) = names::worker_of(&asked.subject) else {
            return no("the subject names no worker");
        };
        let ask: Ask = match serde_json::from_slice(&asked.payload) {
            Ok(ask) => ask,
            Err(error) => {
                tracing::warn!(%worker, %error, "a worker asks what this server does not know");
                return no(&format!("the server does not know this question: {error}"));
            }
        };
        let ban = self.store.workers().ban_of(worker.as_str());
        let ban = ban.map(|reason| format!("the server takes nothing of this worker: {reason}"));
        if let (Ask::Begin { .. } | Ask::Renew { .. } | Ask::HandedIn { .. }, Some(reason)) =
            (&ask, &ban)
        {
            return no(reason);
        }
        let now = self.clock.now();
        let rests = || self.store.workers().rests(worker.as_str(), now);
        let answered = match ask {
            Ask::MayWork(own) => {
                let reason = ban.or_else(|| differs(&own, &self.like)).or_else(rests);
                let about = about(&own);
                let workers = self.store.workers();
                workers.heard(worker.as_str(), about, reason.as_deref(), now);
                return yes_unless(reason);
            }
            Ask::WouldWork(own) => {
                return yes_unless(ban.or_else(|| differs(&own, &self.like)).or_else(rests));
            }
            Ask::Begin { lease, slot } if names::is_word(&slot) => {
                if let Some(reason) = rests() {
                    return no(&reason);
                }
                self.begin(&worker, &lease, &slot).await
            }
            Ask::Begin { .. } => return no("the slot's name is none"),
            Ask::Renew {
                lease,
                episodes_done,
                trouble,
            } => {
                let trouble = trouble.map(|told| -> String {
                    harmless(&told).chars().take(TROUBLE_SHOWN).collect()
                });
                let held = self.renew(&worker, &lease, episodes_done, renewals).await;
                self.stands(&worker, &lease, held, trouble.as_deref())
            }
            Ask::HandedIn {
                lease,
                episodes_done,
                sequence,
            } => {
                let held = self.store.is_of(&worker, lease.unit, lease.nonce).await;
                if matches!(held, Ok(true)) {
                    let now = Instant::now();
                    self.handed_in.add(lease, episodes_done, sequence, now);
                }
                held
            }
        };
        match answered {
            Ok(true) => Answer::Yes,
            Ok(false) => no("it is no longer this worker's"),
            Err(error) => {
                tracing::warn!(%worker, %error, "the queue cannot be asked for a worker");
                Answer::Unknown
            }
        }
    }

    async fn begin(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        slot: &str,
    ) -> Result<bool, StoreError> {
        let claim = claim(lease, WAITING);
        let now = self.clock.now();
        let holder = names::slot(worker, slot);
        let begins = self
            .store
            .hand_over(&claim, &holder, self.lease_s, now)
            .await?;
        if begins {
            let given_out = self.given_out.take(lease.nonce);
            let what = given_out.map(|order| order.what);
            let told = WorkTold {
                what: what.as_deref(),
                trouble: None,
            };
            let workers = self.store.workers();
            workers.works(worker.as_str(), slot, lease.unit, told, now);
        }
        Ok(begins)
    }

    async fn renew(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        done: u32,
        renewals: &Renewals,
    ) -> Result<bool, StoreError> {
        let every = Duration::from_secs(self.lease_s.into()) / 3;
        if !self.store.is_of(worker, lease.unit, lease.nonce).await? {
            return Ok(false);
        }
        if !renewals.is_due(lease.nonce, done, every, Instant::now()) {
            return Ok(true);
        }
        let own = lease.slot.starts_with(&names::slot(worker, ""));
        let claim = claim(lease, if own { &lease.slot } else { worker.as_str() });
        let now = self.clock.now();
        let renewed = self.store.heartbeat(&claim, done, self.lease_s, now);
        let held = renewed.await?;
        if held {
            renewals.written(lease.nonce, done, every, Instant::now());
        }
        Ok(held)
    }

    /// What organisers see of a lease that was asked about.
    fn stands(
        &self,
        worker: &WorkerName,
        lease: &Lease,
        held: Result<bool, StoreError>,
        trouble: Option<&str>,
    ) -> Result<bool, StoreError> {
        let workers = self.store.workers();
        match (&held, lease.slot.strip_prefix(&names::slot(worker, ""))) {
            (Ok(true), Some(slot)) => {
                let told = WorkTold {
                    what: None,
                    trouble,
                };
                workers.works(worker.as_str(), slot, lease.unit, told, self.clock.now());
            }
            (Ok(false), _) => workers.ended(lease.unit),
            _ => {}
        }
        held
    }

    /// Tells those who watch of games that are played elsewhere.
    pub(super) async fn show(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let mut shows = self.client.subscribe(self.names.shows(ALL)).await?;
        loop {
            let told = tokio::select! {
                () = shutdown.cancelled() => return Ok(()),
                told = shows.next() => told,
            };
            let told = told.ok_or_else(|| anyhow::anyhow!("the connection to NATS has ended"))?;
            let Ok(show) = serde_json::from_slice::<RemoteShow>(&told.payload) else {
                continue;
            };
            // Whoever has no work tells of no game. (That it is their own game is believed: what is told decides nothing.)
            let Some(worker) = names::worker_of(&told.subject) else {
                continue;
            };
            let (unit, nonce) = (show.lease.unit, show.lease.nonce);
            let is_its = self.store.is_of(&worker, unit, nonce).await;
            if self.streams.are_ours() && is_its.unwrap_or_default() {
                let live = self.store.live_games();
                match show.shown {
                    Shown::Begun { steps } => live.begin(show.game, show.attempt, steps),
                    Shown::Goes {
                        happenings,
                        position,
                    } => live.advance(show.game, show.attempt, happenings, Some(position)),
                    Shown::Over => live.over(show.game, show.attempt),
                }
            }
        }
    }
}

pub(super) fn claim(lease: &Lease, holder: &str) -> Claim {
    Claim {
        unit: lease.unit,
        nonce: lease.nonce,
        worker: holder.to_owned(),
        lease_until: lease.expires_at,
    }
}

fn yes_unless(reason: Option<String>) -> Answer {
    match reason {
        Some(reason) => Answer::No { reason },
        None => Answer::Yes,
    }
}

/// What organisers see of a worker: no more of its labels than a page shows.
fn about(own: &Introduction) -> WorkerAbout {
    let labels = own.labels.iter().take(Introduction::MOST_LABELS);
    WorkerAbout {
        version: own.version.clone(),
        slots: own.slots,
        labels: labels
            .map(|label| {
                harmless(label)
                    .chars()
                    .take(Introduction::LONGEST_LABEL)
                    .collect()
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renewals_are_written_when_something_has_changed_or_it_is_time() {
        let renewals = Renewals::default();
        let (nonce, start, every) = (Uuid::from_u128(1), Instant::now(), Duration::from_secs(10));
        let is_due = |done, after_s| {
            let now = start + Duration::from_secs(after_s);
            let is_due = renewals.is_due(nonce, done, every, now);
            if is_due {
                renewals.written(nonce, done, every, now);
            }
            is_due
        };
        assert!(is_due(0, 0));
        assert!(!is_due(0, 1));
        assert!(!is_due(1, 1), "an episode more, but soon after");
        assert!(is_due(1, 2), "an episode more");
        assert!(!is_due(1, 11));
        assert!(is_due(1, 12));
    }
}
