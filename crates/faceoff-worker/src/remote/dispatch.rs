//! The server's side: claims what free slots elsewhere ask for, and takes in what came of it.

use super::{
    answers::{Answers, claim},
    bucket::{Bucket, BucketConfig},
    checked::Checks,
    connection::NatsConfig,
    granted::{Taken, grant_of, of_its_order, store},
    names::{self, ALL, Names, ORDERS_CONSUMER, OUTCOMES_CONSUMER, SERVER, WAITING},
    taken_back::{AllGivenOut, GivenOut},
};
use crate::{
    local::LocalServer,
    server::{Claimed, WorkServer},
    service::WorkerConfig,
};
use anyhow::Context as _;
use async_nats::{
    Client,
    jetstream::{
        self, AckKind,
        consumer::{AckPolicy, PullConsumer, pull},
        stream::{self, DiscardPolicy, RetentionPolicy, Stream},
    },
};
use faceoff_store::{Actor, Lot, Store, StoreError, WorkerName, Workers};
use faceoff_types::Clock;
use faceoff_wire::{
    grant::{Grant, GrantKey},
    remote::{Introduction, Outcome, RemoteOrder, RemoteOutcome},
    work::{Lease, WorkOrder},
};
use futures::{StreamExt as _, TryStreamExt as _};
use std::{
    pin::pin,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How often is looked at what nobody tells: orders that nobody begins, work that is due by now.
const LOOK: Duration = Duration::from_secs(1);
/// From one try of what fails to the next.
const REST: Duration = Duration::from_secs(1);
/// What has not failed within this goes well: questions to NATS that is away fail before.
const WELL: Duration = Duration::from_secs(10);
/// An outcome that cannot be stored now is taken again after this.
const AGAIN: Duration = Duration::from_secs(5);
/// What is still being stored of an outcome is there soon.
const SOON: Duration = Duration::from_secs(1);
/// So many outcomes are checked at the same time: each takes a thread of its own for a while.
const CHECKED_AT_ONCE: usize = 2;
/// Orders in the stream at most; there are never more than free slots.
const MOST_ORDERS: i64 = 100_000;
/// Bytes of outcomes that wait for the server at most.
const MOST_OUTCOME_BYTES: i64 = 1 << 30;
/// An outcome that is sent twice within this is stored once by NATS; by the server, always.
const SENT_TWICE_WITHIN: Duration = Duration::from_secs(120);

/// How a server gives work to other machines.
#[derive(Debug, Clone)]
pub struct RemoteConfig {
    /// Where NATS is.
    pub nats: NatsConfig,
    /// Where workers reach this server's files: an address of http or https, without a slash at its end.
    pub files: String,
    /// What grants are sealed with.
    pub key: GrantKey,
    /// What workers must be like.
    pub like: Introduction,
    /// Episodes of each shard that are simulated again before it counts; 0: nothing is.
    pub checked_episodes: u32,
    /// Where bundles and recordings pass, if not by this server's HTTP.
    pub bucket: Option<BucketConfig>,
}

impl RemoteConfig {
    fn checks(&self) -> Checks {
        Checks {
            episodes: self.checked_episodes,
            key: self.key.clone(),
        }
    }
}

/// Gives out work until `shutdown` is cancelled. While NATS is away nothing is given out; what is under way elsewhere goes on.
///
/// # Errors
/// If the configuration is none, or the database cannot be read at the start.
pub async fn dispatch(
    store: Store,
    clock: Clock,
    config: WorkerConfig,
    remote: RemoteConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let names = Names::of(&remote.nats.name)?;
    let server = LocalServer {
        lot: Lot::Plays,
        ..config.local_server(store, clock)
    };
    // Nobody can begin what a former life of this server has given out.
    server.end_leases_of(WAITING).await?;
    let season = server.store.season().await?.commitment;
    let client = remote.nats.connect(SERVER).await?;
    let bucket = match &remote.bucket {
        Some(bucket) => {
            bucket.make_folder()?;
            Some(Arc::new(Bucket::open(bucket.clone())?))
        }
        None => None,
    };
    let hub = Arc::new(Hub {
        bucket,
        jetstream: jetstream::new(client.clone()),
        given_out: Arc::default(),
        owner: format!("Faceoff, season {season}"),
        client,
        names,
        server,
        remote,
    });
    let answers = Answers {
        client: hub.client.clone(),
        names: hub.names.clone(),
        store: hub.server.store.clone(),
        clock: hub.server.clock.clone(),
        lease_s: hub.server.lease_s,
        like: hub.remote.like.clone(),
        given_out: Arc::clone(&hub.given_out),
    };
    let workers = hub.server.store.workers();
    workers.use_them();
    let banned = hub.server.store.worker_bans().await?;
    workers.set_banned(banned.into_iter().map(|ban| (ban.worker, ban.reason)));
    let again = Again {
        workers,
        shutdown: &shutdown,
    };
    tokio::join!(
        again.run("give out work", || hub.give_out(&shutdown)),
        again.run("take in what came of work", || hub.take_in(&shutdown)),
        again.run("answer workers", || answers.answer(&shutdown)),
        again.run("hear of games", || answers.show(&shutdown)),
    );
    hub.take_back(hub.given_out.take_all(), None).await;
    Ok(())
}

/// Does what is to be done until the shutdown, again and again if it fails. The log is told of a change, not of every try; whoever
/// looks after the server finds what is missing as long as it is.
struct Again<'a> {
    workers: &'a Workers,
    shutdown: &'a CancellationToken,
}

impl Again<'_> {
    async fn run<F: Future<Output = anyhow::Result<()>>>(
        &self,
        what: &str,
        mut run: impl FnMut() -> F,
    ) {
        let mut told = String::new();
        while !self.shutdown.is_cancelled() {
            let began = Instant::now();
            let mut running = pin!(run());
            // What goes well for so long is well.
            let ended = match tokio::time::timeout(WELL, &mut running).await {
                Ok(ended) => ended,
                Err(_) => {
                    self.workers.trouble(what, None);
                    told.clear();
                    running.await
                }
            };
            let Err(error) = ended else {
                continue;
            };
            let cause = format!("{error:#}");
            if cause != told {
                tracing::error!(cause, "cannot {what}; trying again");
                self.workers.trouble(what, Some(&cause));
                told = cause;
            }
            tokio::select! {
                () = self.shutdown.cancelled() => {}
                () = tokio::time::sleep_until((began + REST).into()) => {}
            }
        }
    }
}

/// What gives out and takes in.
struct Hub {
    client: Client,
    jetstream: jetstream::Context,
    names: Names,
    server: LocalServer,
    remote: RemoteConfig,
    bucket: Option<Arc<Bucket>>,
    given_out: Arc<AllGivenOut>,
    /// Whose streams these are.
    owner: String,
}

impl Hub {
    async fn give_out(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let stream = self.stream(self.orders_config()).await?;
        let mut consumer = self.consumer(&stream, orders_consumer()).await?;
        let mut free = self.client.subscribe(self.names.free(ALL)).await?;
        let mut signal = self.server.store.work_signal();
        while !shutdown.is_cancelled() {
            signal.borrow_and_update();
            let late = self.given_out.take_late(Instant::now());
            self.take_back(late, Some(&stream)).await;
            let info = consumer.info().await.context("asking who waits for work")?;
            let waiting = u64::try_from(info.num_waiting).unwrap_or_default();
            for _ in 0..waiting.saturating_sub(info.num_pending) {
                if !self.give_out_one().await? {
                    break;
                }
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                changed = signal.changed() => changed.context("listening to the queue")?,
                told = free.next() => anyhow::ensure!(told.is_some(), "the connection to NATS has ended"),
                () = tokio::time::sleep(LOOK) => {}
            }
        }
        Ok(())
    }

    /// Is there more to give out?
    async fn give_out_one(&self) -> anyhow::Result<bool> {
        let server = self.server.clone();
        let claimed = tokio::task::spawn_blocking(move || server.claim(WAITING)).await??;
        let Claimed::Order(order) = claimed else {
            return Ok(false);
        };
        let (lease, what) = (order.lease.clone(), order.assignment.to_string());
        self.given_out.add(lease.clone(), what, Instant::now());
        match self.publish(*order).await {
            Ok(sequence) => {
                self.given_out.is_published(lease.nonce, sequence);
                Ok(true)
            }
            // It may have gone out all the same: then nobody can begin it, or somebody has.
            Err(error) => {
                let _ = self.given_out.take(lease.nonce);
                self.release(lease).await;
                Err(error)
            }
        }
    }

    /// Its place in the stream.
    async fn publish(&self, order: WorkOrder) -> anyhow::Result<u64> {
        let grant = grant_of(&order);
        let objects = match &self.bucket {
            Some(bucket) => {
                let artifacts = self.server.store.artifacts();
                Some(bucket.opens(&grant, artifacts).await?)
            }
            None => None,
        };
        let grant = grant.sealed(&self.remote.key)?;
        let files = self.remote.files.clone();
        let order = serde_json::to_vec(&RemoteOrder {
            order,
            grant,
            files,
            program: self.remote.like.program.clone(),
            objects,
        })?;
        let published = self.jetstream.publish(self.names.orders(), order.into());
        let acknowledged = published.await.context("publishing an order")?;
        let acknowledged = acknowledged.await.context("publishing an order")?;
        Ok(acknowledged.sequence)
    }

    /// Puts orders back into the queue that nobody has begun.
    async fn take_back(&self, orders: Vec<GivenOut>, stream: Option<&Stream>) {
        for order in orders {
            self.release(order.lease).await;
            // Whoever gets it yet is told that it is nobody's.
            if let (Some(stream), Some(sequence)) = (stream, order.sequence)
                && let Err(error) = stream.delete_message(sequence).await
            {
                tracing::debug!(%error, "an order that was taken back stays in the stream");
            }
        }
    }

    async fn release(&self, lease: Lease) {
        let (store, unit, now) = (&self.server.store, lease.unit, self.server.clock.now());
        let claim = claim(&lease, WAITING);
        match store.take_back(&claim, now).await {
            Ok(true) => tracing::debug!(%unit, "taken back: nobody has begun it"),
            Ok(false) => {}
            Err(error) => {
                tracing::warn!(%unit, %error, "an order could not be taken back; its lease will end");
            }
        }
    }

    async fn take_in(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let stream = self.stream(self.outcomes_config()).await?;
        let consumer = self.consumer(&stream, outcomes_consumer()).await?;
        while !shutdown.is_cancelled() {
            let outcomes = consumer
                .batch()
                .max_messages(64)
                .expires(LOOK)
                .messages()
                .await
                .context("asking for what came of work")?;
            outcomes
                .map_err(|error| anyhow::anyhow!(error))
                .try_for_each_concurrent(CHECKED_AT_ONCE, async |message| {
                    let acknowledgement = self.take(&message).await;
                    let acknowledged = message.ack_with(acknowledgement).await;
                    acknowledged.map_err(|error| anyhow::anyhow!(error))
                })
                .await?;
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
        let workers = self.server.store.workers();
        if workers.ban_of(worker.as_str()).is_some() {
            tracing::warn!(%unit, %worker, "the worker is banned: what came of it is left out");
            return AckKind::Ack;
        }
        let nonce = outcome.lease.nonce;
        let acknowledgement = match self.stored(message, grant, outcome).await {
            Ok(Taken::Held) => {
                workers.ended(unit);
                tracing::info!(%unit, %worker, "taken in");
                AckKind::Ack
            }
            Ok(Taken::Lost) => {
                tracing::info!(%unit, %worker, "no longer this worker's; what came of it is left out");
                AckKind::Ack
            }
            Ok(Taken::Disbelieved(difference)) => self.ban(&worker, &difference).await,
            Ok(Taken::StillComing) => return AckKind::Nak(Some(SOON)),
            Err(error) => {
                tracing::error!(%unit, %worker, cause = format!("{error:#}"), "what came of a unit cannot be stored; trying again");
                return AckKind::Nak(Some(AGAIN));
            }
        };
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

    /// A stream that is as it is to be, and ours.
    async fn stream(&self, wanted: stream::Config) -> anyhow::Result<Stream> {
        let name = wanted.name.clone();
        let doing = || format!("setting up the stream {name}");
        let stream = self.jetstream.get_or_create_stream(wanted.clone());
        let mut stream = stream.await.with_context(doing)?;
        let found = &stream.cached_info().config;
        anyhow::ensure!(
            found.description == wanted.description,
            "the stream {name} is another server's ({}): give each its own nats.name",
            found
                .description
                .as_deref()
                .unwrap_or("it does not say whose")
        );
        if !is_like(found, &wanted) {
            self.jetstream
                .update_stream(&wanted)
                .await
                .with_context(|| {
                    format!(
                        "the stream {name} was made otherwise than this server needs it, and NATS does not change it: delete it \
                         (`nats stream rm {name}`), and this server makes it anew; what it held is played again"
                    )
                })?;
            let found = &stream.info().await.with_context(doing)?.config;
            anyhow::ensure!(
                is_like(found, &wanted),
                "NATS keeps the stream {name} otherwise than it was asked to; a newer nats-server may not"
            );
        }
        Ok(stream)
    }

    async fn consumer(
        &self,
        stream: &Stream,
        wanted: pull::Config,
    ) -> anyhow::Result<PullConsumer> {
        let consumer = stream.create_consumer(wanted.clone()).await;
        let name = wanted.durable_name.as_deref().unwrap_or_default();
        let consumer = consumer.with_context(|| format!("setting up the consumer {name}"))?;
        let found = &consumer.cached_info().config;
        anyhow::ensure!(
            found.max_deliver == wanted.max_deliver && found.ack_policy == wanted.ack_policy,
            "NATS keeps the consumer {name} otherwise than it was asked to; a newer nats-server may not"
        );
        Ok(consumer)
    }

    fn orders_config(&self) -> stream::Config {
        stream::Config {
            name: self.names.orders_stream(),
            subjects: vec![self.names.orders()],
            description: Some(self.owner.clone()),
            retention: RetentionPolicy::WorkQueue,
            discard: DiscardPolicy::New,
            max_messages: MOST_ORDERS,
            ..stream::Config::default()
        }
    }

    fn outcomes_config(&self) -> stream::Config {
        stream::Config {
            name: self.names.outcomes_stream(),
            subjects: vec![self.names.outcomes(ALL)],
            description: Some(self.owner.clone()),
            retention: RetentionPolicy::WorkQueue,
            discard: DiscardPolicy::New,
            max_bytes: MOST_OUTCOME_BYTES,
            duplicate_window: SENT_TWICE_WITHIN,
            ..stream::Config::default()
        }
    }
}

fn is_like(found: &stream::Config, wanted: &stream::Config) -> bool {
    found.subjects == wanted.subjects
        && found.retention == wanted.retention
        && found.discard == wanted.discard
        && found.storage == wanted.storage
        && (wanted.max_messages == 0 || found.max_messages == wanted.max_messages)
        && (wanted.max_bytes == 0 || found.max_bytes == wanted.max_bytes)
}

/// Each order is delivered once: that nobody has begun it, the server notices by itself.
fn orders_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(ORDERS_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        max_deliver: 1,
        max_ack_pending: MOST_ORDERS,
        max_waiting: 8192,
        ..pull::Config::default()
    }
}

fn outcomes_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(OUTCOMES_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        ack_wait: Duration::from_secs(60),
        max_deliver: -1,
        ..pull::Config::default()
    }
}
