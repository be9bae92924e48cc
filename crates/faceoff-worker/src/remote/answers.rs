//! What workers elsewhere ask the server, and are answered at once.

use super::{
    names::{self, ALL, Names, WAITING},
    taken_back::AllGivenOut,
};
use async_nats::{Client, Message};
use faceoff_store::{Claim, Store, StoreError, WorkerAbout, WorkerName};
use faceoff_types::{Clock, PythonInventory, RuntimeContent, harmless};
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
}

/// So many are answered at the same time.
const AT_ONCE: usize = 64;

/// How often progress is written: each time is a transaction that waits for the disk.
const PROGRESS_EVERY: Duration = Duration::from_secs(2);

/// When leases were last written as renewed, and how far the work was: workers ask more often than the database needs to know.
#[derive(Debug, Default)]
struct Renewals(Mutex<HashMap<Uuid, (Instant, u32)>>);

impl Renewals {
    /// Is it to be written, because it is new, has progressed since a while, or was written so long ago?
    fn is_due(&self, nonce: Uuid, done: u32, every: Duration, now: Instant) -> bool {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // What nobody asks about any more is forgotten.
        all.retain(|_, (at, _)| now.duration_since(*at) < 100 * every);
        let is_due = all.get(&nonce).is_none_or(|(at, before)| {
            let ago = now.duration_since(*at);
            ago >= every || (*before != done && ago >= PROGRESS_EVERY)
        });
        if is_due {
            all.insert(nonce, (now, done));
        }
        is_due
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
        if let (Ask::Begin { .. } | Ask::Renew { .. }, Some(reason)) = (&ask, &ban) {
            return no(reason);
        }
        let answered = match ask {
            Ask::MayWork(own) => {
                let reason = ban.or_else(|| differs(&own, &self.like));
                let (about, now) = (about(&own), self.clock.now());
                let workers = self.store.workers();
                workers.heard(worker.as_str(), about, reason.as_deref(), now);
                return yes_unless(reason);
            }
            Ask::WouldWork(own) => {
                return yes_unless(ban.or_else(|| differs(&own, &self.like)));
            }
            Ask::Begin { lease, slot } if names::is_word(&slot) => {
                self.begin(&worker, &lease, &slot).await
            }
            Ask::Begin { .. } => return no("the slot's name is none"),
            Ask::Renew {
                lease,
                episodes_done,
            } => self.renew(&worker, &lease, episodes_done, renewals).await,
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
        let given_out = self.given_out.take(lease.nonce);
        let claim = claim(lease, WAITING);
        let now = self.clock.now();
        let holder = names::slot(worker, slot);
        let begins = self
            .store
            .hand_over(&claim, &holder, self.lease_s, now)
            .await?;
        if begins {
            let what = given_out.map(|order| order.what);
            let workers = self.store.workers();
            workers.works(worker.as_str(), slot, lease.unit, what.as_deref(), now);
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
        let now = self.clock.now();
        let own = lease.slot.strip_prefix(&names::slot(worker, ""));
        let held = if renewals.is_due(lease.nonce, done, every, Instant::now()) {
            let claim = claim(lease, own.map_or(worker.as_str(), |_| &lease.slot));
            self.store
                .heartbeat(&claim, done, self.lease_s, now)
                .await?
        } else {
            self.store.is_held(lease.unit, lease.nonce).await?
        };
        let workers = self.store.workers();
        match own {
            Some(slot) if held => workers.works(worker.as_str(), slot, lease.unit, None, now),
            _ if !held => workers.ended(lease.unit),
            _ => {}
        }
        Ok(held)
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
            let (unit, nonce) = (show.lease.unit, show.lease.nonce);
            if self.store.is_held(unit, nonce).await.unwrap_or_default() {
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

/// Why a worker may not work for this server.
fn differs(own: &Introduction, like: &Introduction) -> Option<String> {
    if own.program != like.program {
        return Some(format!(
            "the worker runs another program (version {}, BLAKE3 {}) than the server (version {}, BLAKE3 {}): only the same program \
             has the same results to the last bit; copy the server's to the worker's machine",
            own.version, own.program, like.version, like.program
        ));
    }
    let offered = |name: &str| own.runtimes.iter().find(|runtime| runtime.name == name);
    let missing: Vec<&str> = like
        .runtimes
        .iter()
        .map(|runtime| &*runtime.name)
        .filter(|name| offered(name).is_none())
        .collect();
    if !missing.is_empty() {
        return Some(format!(
            "the worker lacks runtimes that the server offers to agents: {}; set them up in the worker's configuration",
            missing.join(", ")
        ));
    }
    like.runtimes.iter().find_map(|runtime| {
        let other = runtime_differs(&offered(&runtime.name)?.content, &runtime.content)?;
        Some(format!(
            "the worker's runtime {} is not the server's: {other}; agents are to find the same everywhere",
            runtime.name
        ))
    })
}

/// What a worker's runtime has otherwise than the server's. One that does not work on the server plays nowhere.
fn runtime_differs(own: &RuntimeContent, like: &RuntimeContent) -> Option<String> {
    let shown = |version: Option<&String>| version.map_or_else(|| "none".to_owned(), Clone::clone);
    let libc = |own: &Option<String>, like: &Option<String>| {
        let differs = own != like;
        differs.then(|| {
            format!(
                "its C library is {}, the server's {}",
                shown(own.as_ref()),
                shown(like.as_ref())
            )
        })
    };
    match (own, like) {
        (_, RuntimeContent::Broken { .. }) | (RuntimeContent::Image, RuntimeContent::Image) => None,
        (RuntimeContent::Broken { why }, _) => Some(format!("it does not work there: {why}")),
        (RuntimeContent::Native { libc: own }, RuntimeContent::Native { libc: like }) => {
            libc(own, like)
        }
        (RuntimeContent::Python(own), RuntimeContent::Python(like)) => {
            let python = |of: &PythonInventory| format!("{} {}", of.implementation, of.version);
            if python(own) != python(like) {
                return Some(format!(
                    "it is {}, the server's {}",
                    python(own),
                    python(like)
                ));
            }
            let names = own.packages.keys().chain(like.packages.keys());
            let package = names
                .map(|name| (name, own.packages.get(name), like.packages.get(name)))
                .find(|(_, own, like)| own != like);
            package.map_or_else(
                || libc(&own.libc, &like.libc),
                |(name, own, like)| {
                    let (own, like) = (shown(own), shown(like));
                    Some(format!("its package {name} is {own}, the server's {like}"))
                },
            )
        }
        _ => Some("it is of another kind".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::RuntimeInventory;

    fn python(version: &str, packages: &[(&str, &str)]) -> RuntimeContent {
        let packages = packages.iter();
        RuntimeContent::Python(PythonInventory {
            implementation: "CPython".into(),
            version: version.into(),
            libc: Some("2.36".into()),
            packages: packages
                .map(|(name, version)| ((*name).into(), (*version).into()))
                .collect(),
        })
    }

    fn native(libc: &str) -> RuntimeContent {
        RuntimeContent::Native {
            libc: Some(libc.into()),
        }
    }

    fn introduced(program: &str, runtimes: &[(&str, RuntimeContent)]) -> Introduction {
        let runtimes = runtimes.iter().cloned();
        Introduction {
            program: program.into(),
            version: "1".into(),
            runtimes: runtimes
                .map(|(name, content)| RuntimeInventory {
                    name: name.into(),
                    content,
                })
                .collect(),
            slots: 4,
            labels: Vec::new(),
        }
    }

    #[test]
    fn a_worker_is_like_the_server_or_is_told_why_not() {
        let numpy = || python("3.11.2", &[("numpy", "2.4.6")]);
        let like = introduced("aa", &[("native", native("2.36")), ("python3", numpy())]);
        let told = |program: &str, runtimes: &[(&str, RuntimeContent)]| {
            differs(&introduced(program, runtimes), &like)
        };
        let native_here = ("native", native("2.36"));
        let more = [
            ("julia", native("2.36")),
            ("python3", numpy()),
            native_here.clone(),
        ];
        assert_eq!(told("aa", &more), None);
        for (program, runtimes, words) in [
            (
                "bb",
                vec![native_here.clone(), ("python3", numpy())],
                "another program",
            ),
            (
                "aa",
                vec![native_here.clone()],
                "lacks runtimes that the server offers to agents: python3",
            ),
            (
                "aa",
                vec![("native", native("2.41")), ("python3", numpy())],
                "runtime native is not the server's: its C library is 2.41, the server's 2.36",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", python("3.12.1", &[("numpy", "2.4.6")])),
                ],
                "it is CPython 3.12.1, the server's CPython 3.11.2",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", python("3.11.2", &[("numpy", "1.26.4")])),
                ],
                "its package numpy is 1.26.4, the server's 2.4.6",
            ),
            (
                "aa",
                vec![native_here.clone(), ("python3", python("3.11.2", &[]))],
                "its package numpy is none, the server's 2.4.6",
            ),
            (
                "aa",
                vec![
                    native_here.clone(),
                    ("python3", RuntimeContent::Broken { why: "gone".into() }),
                ],
                "it does not work there: gone",
            ),
            (
                "aa",
                vec![native_here.clone(), ("python3", native("2.36"))],
                "of another kind",
            ),
        ] {
            let found = told(program, &runtimes).unwrap_or_default();
            assert!(found.contains(words), "{found:?} lacks {words:?}");
        }
        // What does not work on the server is asked of nobody else.
        let broken = introduced(
            "aa",
            &[("python3", RuntimeContent::Broken { why: "gone".into() })],
        );
        assert_eq!(
            differs(&introduced("aa", &[("python3", numpy())]), &broken),
            None
        );
    }

    #[test]
    fn renewals_are_written_when_something_has_changed_or_it_is_time() {
        let renewals = Renewals::default();
        let (nonce, start, every) = (Uuid::from_u128(1), Instant::now(), Duration::from_secs(10));
        let is_due = |done, after_s| {
            renewals.is_due(nonce, done, every, start + Duration::from_secs(after_s))
        };
        assert!(is_due(0, 0));
        assert!(!is_due(0, 1));
        assert!(!is_due(1, 1), "an episode more, but soon after");
        assert!(is_due(1, 2), "an episode more");
        assert!(!is_due(1, 11));
        assert!(is_due(1, 12));
    }
}
