//! The server as a slot on another machine sees it: orders, questions and outcomes go by NATS, files by the server's own HTTP.

use super::{
    connection::ANSWER,
    names::{self, Names, ORDERS_CONSUMER},
    order_files::OrderFiles,
};
use crate::{
    full_disk,
    server::{Claimed, GameShow, GivenBack, Holding, QueueMark, WorkServer},
};
use anyhow::Context as _;
use async_nats::{
    Client, HeaderMap,
    jetstream::{self, consumer::PullConsumer},
};
use faceoff_dataset::CLIPS_FILE;
use faceoff_store::WorkerName;
use faceoff_types::{BundleRef, GameId};
use faceoff_wire::{
    remote::{Answer, Ask, Introduction, Outcome, RemoteOrder, RemoteOutcome, RemoteShow, Shown},
    work::{Lease, WorkReport},
};
use futures::StreamExt as _;
use std::{
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// How long a request for an order stays open; it may die silently, and is made anew. So short, it is its own heartbeat. NATS's are not
/// asked for: a `Batch` of async-nats (0.51) that has read one is not woken by what comes next, and the order is lost.
const OPEN_FOR: Duration = Duration::from_secs(5);
/// After a refusal or a failure, until it is asked again.
const REST: Duration = Duration::from_secs(2);
/// A worker without room leaves the queue to others for so long; what it gives back rests there, and it would make all of it rest.
const FULL_DISK_REST: Duration = Duration::from_secs(10);
/// So long a worker goes on without asking whether it may.
const MAY_WORK_FOR: Duration = Duration::from_secs(5);
/// More than the headers of an outcome have; they count as part of the message.
const HEADERS_AT_MOST: usize = 256;
/// Nobody waits longer to show a position.
const SHOWS_WITHIN: Duration = Duration::from_millis(20);

/// A worker's connection, shared by its slots.
pub(super) struct Link {
    pub(super) runtime: Handle,
    pub(super) client: Client,
    pub(super) names: Names,
    pub(super) worker: WorkerName,
    pub(super) own: Introduction,
    pub(super) http: reqwest::Client,
    pub(super) shutdown: CancellationToken,
    /// Why it may not work, as it was told last: the log is told of a change.
    pub(super) refused: Mutex<Option<String>>,
    /// When a slot last had something to do.
    pub(super) busy_at: Mutex<Instant>,
    /// When the server last said that it may work.
    pub(super) may_work_at: Mutex<Option<Instant>>,
}

impl Link {
    /// For how long no slot has had anything to do.
    pub(super) fn idle_for(&self) -> Duration {
        let busy_at = self.busy_at.lock();
        busy_at.unwrap_or_else(PoisonError::into_inner).elapsed()
    }

    fn is_busy(&self) {
        let mut busy_at = self.busy_at.lock().unwrap_or_else(PoisonError::into_inner);
        *busy_at = Instant::now();
    }
}

/// The server of one slot.
pub(super) struct FarServer {
    link: Arc<Link>,
    jetstream: jetstream::Context,
    /// What orders are asked of, while it answers.
    consumer: Mutex<Option<PullConsumer>>,
    current: Mutex<Current>,
    /// When there was last no room for something.
    full_at: Mutex<Option<Instant>>,
}

/// What the slot works at.
#[derive(Debug, Default)]
struct Current {
    files: Arc<OrderFiles>,
    /// When the server last said that it is this slot's.
    held_at: Option<Instant>,
    /// It is no longer this slot's.
    is_lost: bool,
}

impl FarServer {
    pub(super) fn new(link: Arc<Link>) -> Self {
        Self {
            jetstream: jetstream::new(link.client.clone()),
            link,
            consumer: Mutex::default(),
            current: Mutex::default(),
            full_at: Mutex::default(),
        }
    }

    /// Had this slot no room just now?
    fn is_without_room(&self) -> bool {
        let full_at = self.full_at.lock().unwrap_or_else(PoisonError::into_inner);
        full_at.is_some_and(|at| at.elapsed() < FULL_DISK_REST)
    }

    fn current(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is what it works at no longer its own? At the end of this worker it is given back.
    fn has_ended(&self) -> bool {
        self.current().is_lost || self.link.shutdown.is_cancelled()
    }

    /// Those of what it works at.
    fn files(&self) -> Arc<OrderFiles> {
        Arc::clone(&self.current().files)
    }

    async fn store(&self, name: &str, file: &Path) -> anyhow::Result<()> {
        let http = &self.link.http;
        let files = self.files();
        files.store(http, name, file, || self.has_ended()).await
    }

    async fn rest(&self) {
        tokio::select! {
            () = self.link.shutdown.cancelled() => {}
            () = tokio::time::sleep(REST) => {}
        }
    }

    async fn ask(&self, ask: &Ask) -> anyhow::Result<Answer> {
        let question = serde_json::to_vec(ask)?;
        let subject = self.link.names.asks(self.link.worker.as_str());
        let answer = self.link.client.request(subject, question.into());
        let answer = answer.await.context("asking the server")?;
        serde_json::from_slice(&answer.payload).context("the server's answer")
    }

    /// May this worker work? The log is told when that changes. What was answered a moment ago holds: an order says by itself of which
    /// program it is, and whether it is this worker's the server says when it begins.
    async fn may_work(&self) -> anyhow::Result<bool> {
        let asked_at = || {
            let at = self.link.may_work_at.lock();
            at.unwrap_or_else(PoisonError::into_inner)
        };
        if asked_at().is_some_and(|at| at.elapsed() < MAY_WORK_FOR) {
            return Ok(true);
        }
        let answer = self.ask(&Ask::MayWork(self.link.own.clone())).await?;
        let reason = match answer {
            Answer::Yes => None,
            Answer::No { reason } => Some(reason),
            Answer::Unknown => return Ok(false),
        };
        let mut refused = self
            .link
            .refused
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if *refused != reason {
            match &reason {
                Some(reason) => tracing::error!(reason, "the server gives this worker no work"),
                None => tracing::info!("the server gives this worker work"),
            }
            refused.clone_from(&reason);
        }
        *asked_at() = reason.is_none().then(Instant::now);
        Ok(reason.is_none())
    }

    /// What orders are asked of. It is asked for anew after a failure: the stream may have been made anew.
    async fn consumer(&self) -> anyhow::Result<PullConsumer> {
        let known = || self.consumer.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(consumer) = known().clone() {
            return Ok(consumer);
        }
        let stream = self.link.names.orders_stream();
        let found = self
            .jetstream
            .get_consumer_from_stream(ORDERS_CONSUMER, stream);
        let found: PullConsumer = found
            .await
            .map_err(|error| anyhow::anyhow!("asking for orders: {error}"))?;
        *known() = Some(found.clone());
        Ok(found)
    }

    /// Waits for an order.
    async fn order(&self, slot: &str) -> anyhow::Result<Option<RemoteOrder>> {
        let link = &self.link;
        let consumer = self.consumer().await?;
        let mut orders = consumer
            .batch()
            .max_messages(1)
            .expires(OPEN_FOR)
            .messages()
            .await
            .context("asking for an order")?;
        let free = link.names.free(link.worker.as_str());
        link.client.publish(free, Default::default()).await?;
        let order = tokio::select! {
            // What comes now is not begun, and taken back.
            () = link.shutdown.cancelled() => return Ok(None),
            order = orders.next() => order,
        };
        let Some(order) = order else {
            return Ok(None);
        };
        let message = order.map_err(|error| anyhow::anyhow!("waiting for an order: {error}"))?;
        // Each order is delivered once: whose it is decides the lease, and not NATS.
        message
            .ack()
            .await
            .map_err(|error| anyhow::anyhow!("acknowledging an order: {error}"))?;
        let mut order: RemoteOrder =
            serde_json::from_slice(&message.payload).context("an order")?;
        if order.program != link.own.program {
            // Nobody begins it, so it is given out again; the next answer says what is wrong.
            *link
                .may_work_at
                .lock()
                .unwrap_or_else(PoisonError::into_inner) = None;
            return Ok(None);
        }
        let begin = Ask::Begin {
            lease: order.order.lease.clone(),
            slot: slot.to_owned(),
        };
        Ok(match self.ask(&begin).await? {
            Answer::Yes => {
                order.order.lease.slot = names::slot(&link.worker, slot);
                Some(order)
            }
            Answer::No { .. } | Answer::Unknown => None,
        })
    }

    /// Sends what came of an order, until NATS has stored it or, of what was played, until the order is no longer this slot's. What is too
    /// large stays so until somebody helps: after a lease, the server is to know.
    async fn send(&self, lease: &Lease, outcome: Outcome) -> anyhow::Result<Holding> {
        let was_played = matches!(outcome, Outcome::Done { .. });
        let outcome = RemoteOutcome {
            lease: lease.clone(),
            grant: self.current().files.grant.clone(),
            outcome,
        };
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", outcome.id());
        let payload = serde_json::to_vec(&outcome)?;
        let began = Instant::now();
        let within = Duration::from_secs(lease.duration_s.into());
        let subject = self.link.names.outcomes(self.link.worker.as_str());
        // The log is told of a change, not of every try.
        let mut told = String::new();
        loop {
            let sent = async {
                // It may be another after NATS was started anew.
                let largest = self.link.client.max_payload();
                if payload.len() + HEADERS_AT_MOST > largest {
                    return Err(anyhow::Error::from(TooLarge {
                        bytes: payload.len(),
                        largest,
                    }));
                }
                let sent = self.jetstream.publish_with_headers(
                    subject.clone(),
                    headers.clone(),
                    payload.clone().into(),
                );
                anyhow::Ok(sent.await?.await?)
            };
            let Err(error) = sent.await else {
                return Ok(Holding::Held);
            };
            if was_played && self.has_ended() {
                return Ok(Holding::Lost);
            }
            if error.is::<TooLarge>() && began.elapsed() >= within {
                return Err(error).context("sending what came of the order");
            }
            let cause = format!("{error:#}");
            if cause != told {
                tracing::warn!(unit = %lease.unit, cause, "what came of the order is not stored by NATS yet; trying again");
                told = cause;
            }
            tokio::time::sleep(REST).await;
        }
    }
}

/// NATS takes no message of this size.
#[derive(Debug, thiserror::Error)]
#[error(
    "what came of the order has {bytes} bytes, and NATS takes messages of {largest} at most: raise its max_payload"
)]
pub(crate) struct TooLarge {
    bytes: usize,
    largest: usize,
}

impl WorkServer for FarServer {
    fn claim(&self, slot: &str) -> anyhow::Result<Claimed> {
        // NATS wakes who waits here: there is no queue to look at.
        let queue = QueueMark(0);
        self.link.runtime.block_on(async {
            if self.is_without_room() {
                self.rest().await;
                return Ok(Claimed::Nothing { queue });
            }
            match self.may_work().await {
                Ok(true) => {}
                Ok(false) => {
                    self.rest().await;
                    return Ok(Claimed::Nothing { queue });
                }
                Err(error) => {
                    self.rest().await;
                    return Err(error);
                }
            }
            let order = match self.order(slot).await {
                Ok(order) => order,
                Err(error) => {
                    *self.consumer.lock().unwrap_or_else(PoisonError::into_inner) = None;
                    self.rest().await;
                    return Err(error);
                }
            };
            let Some(RemoteOrder {
                order,
                grant,
                files,
                objects,
                ..
            }) = order
            else {
                return Ok(Claimed::Nothing { queue });
            };
            self.link.is_busy();
            *self.current() = Current {
                files: Arc::new(OrderFiles {
                    grant,
                    server: files,
                    objects,
                }),
                held_at: Some(Instant::now()),
                is_lost: false,
            };
            Ok(Claimed::Order(Box::new(order)))
        })
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<Holding> {
        self.link.is_busy();
        let ask = Ask::Renew {
            lease: lease.clone(),
            episodes_done,
            trouble: None,
        };
        let answer = self.link.runtime.block_on(self.ask(&ask));
        match answer {
            Ok(Answer::Yes) => {
                self.current().held_at = Some(Instant::now());
                Ok(Holding::Held)
            }
            Ok(Answer::No { .. }) => {
                self.current().is_lost = true;
                Ok(Holding::Lost)
            }
            Ok(Answer::Unknown) | Err(_) => {
                let held_at = self.current().held_at;
                let cut_off = Duration::from_secs(lease.duration_s.into());
                if held_at.is_some_and(|at| at.elapsed() > cut_off) {
                    tracing::error!(unit = %lease.unit, "nothing was heard of the server for as long as the lease is: this worker stops");
                    self.current().is_lost = true;
                    return Ok(Holding::Lost);
                }
                answer
                    .map(|_| Holding::Held)
                    .and_then(|_| anyhow::bail!("the server cannot tell now"))
            }
        }
    }

    fn renews_every(&self, _: &Lease) -> Duration {
        // So soon a worker hears that its work is not wanted any more.
        Duration::from_millis(500)
    }

    fn show(&self, lease: &Lease, (game, attempt): (GameId, u32), show: GameShow) {
        let shown = match show {
            GameShow::Begun { steps } => Shown::Begun { steps },
            GameShow::Goes {
                happenings,
                position,
            } => Shown::Goes {
                happenings,
                position,
            },
            GameShow::Over => Shown::Over,
        };
        let show = RemoteShow {
            lease: lease.clone(),
            game,
            attempt,
            shown,
        };
        let Ok(words) = serde_json::to_vec(&show) else {
            return;
        };
        let subject = self.link.names.shows(self.link.worker.as_str());
        self.link.runtime.block_on(async {
            let published = self.link.client.publish(subject, words.into());
            // What is not shown in time is not shown.
            let _ = tokio::time::timeout(SHOWS_WITHIN, published).await;
        });
    }

    fn commit(&self, lease: &Lease, report: WorkReport) -> anyhow::Result<Holding> {
        let report = Box::new(report);
        let sent = self.send(lease, Outcome::Done { report });
        let holding = self.link.runtime.block_on(sent)?;
        self.link.is_busy();
        Ok(holding)
    }

    fn give_back(&self, lease: &Lease, why: GivenBack<'_>) -> anyhow::Result<()> {
        let outcome = match why {
            GivenBack::Shutdown => Outcome::Shutdown,
            GivenBack::FullDisk => {
                let mut full_at = self.full_at.lock().unwrap_or_else(PoisonError::into_inner);
                *full_at = Some(Instant::now());
                Outcome::FullDisk
            }
            GivenBack::PlatformFault(reason) => Outcome::PlatformFault {
                reason: reason.to_owned(),
            },
        };
        self.link.runtime.block_on(async {
            let sent = tokio::time::timeout(ANSWER, self.send(lease, outcome));
            sent.await.context("telling the server")?.map(drop)
        })
    }

    fn met_full_disk(&self, error: &anyhow::Error) -> bool {
        full_disk::is_told_by(error)
    }

    fn wait(&self, stop: &CancellationToken, at_most: Duration, queue: Option<QueueMark>) {
        // Who asks for an order has waited already.
        if queue.is_some() {
            return;
        }
        self.link.runtime.block_on(async {
            tokio::select! {
                () = stop.cancelled() => {}
                () = tokio::time::sleep(at_most) => {}
            }
        });
    }

    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        let (files, http) = (self.files(), &self.link.http);
        let fetched = files.fetch_bundle(http, bundle, archive, || self.has_ended());
        self.link.runtime.block_on(fetched)
    }

    fn fetch_recording(&self, key: &str, _: &Path) -> anyhow::Result<()> {
        anyhow::bail!("no order to another machine asks for the recording {key}")
    }

    fn store_recording(&self, _: &str, folder: &Path) -> anyhow::Result<()> {
        self.link.runtime.block_on(async {
            let mut entries = tokio::fs::read_dir(folder).await?;
            while let Some(entry) = entries.next_entry().await? {
                let name = entry.file_name();
                let name = name.to_str().context("a recording's file without a name")?;
                self.store(name, &entry.path()).await?;
            }
            Ok(())
        })
    }

    fn store_clips(&self, _: &str, clips: &Path) -> anyhow::Result<()> {
        self.link.runtime.block_on(self.store(CLIPS_FILE, clips))
    }

    fn store_dataset(&self, key: &str, _: &Path, _: Option<&Path>) -> anyhow::Result<()> {
        anyhow::bail!("no order to another machine asks for the dataset {key}")
    }
}
