//! The server's side: claims what free slots elsewhere ask for, and takes in what came of it.

use super::{
    answers::{Answers, claim},
    bucket::{Bucket, BucketConfig},
    checked::Checks,
    connection::NatsConfig,
    granted::grant_of,
    handed_in::AllHandedIn,
    names::{self, ALL, Names, SERVER, WAITING},
    streams::{LOST_A_PART, Streams, is_ahead},
    taken_back::{AllGivenOut, GivenOut},
};
use crate::{
    boxed,
    local::LocalServer,
    server::{Claimed, WorkServer},
    service::WorkerConfig,
};
use anyhow::Context as _;
use async_nats::{
    Client,
    jetstream::{self, stream::Stream},
};
use faceoff_store::{Lot, Store, StoreError, Workers};
use faceoff_types::Clock;
use faceoff_wire::{
    grant::GrantKey,
    remote::{Introduction, RemoteOrder},
    work::{Lease, WorkOrder},
};
use futures::StreamExt as _;
use std::{
    pin::pin,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How often is looked at what nobody tells: orders that nobody begins, work that is due by now.
pub(super) const LOOK: Duration = Duration::from_secs(1);
/// From one try of what fails to the next.
const REST: Duration = Duration::from_secs(1);
/// What has not failed within this goes well: questions to NATS that is away fail before.
const WELL: Duration = Duration::from_secs(10);
/// What workers hold when the server starts is theirs for so long at least, seconds: nobody could renew it before.
const AT_LEAST_AT_START_S: u32 = 60;
/// What the server cannot do while NATS is away, which is the cause of all else.
const REACHES_NATS: &str = "reach NATS";

/// How a server gives work to other machines.
#[derive(Debug, Clone)]
pub struct RemoteConfig {
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
    pub(super) fn checks(&self) -> Checks {
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
#[boxed]
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
    take_over(&server).await?;
    let season = server.store.season().await?.commitment;
    let store = server.store.clone();
    let workers = store.workers();
    workers.use_them();
    let tell = workers.clone();
    let client = remote
        .nats
        .connect(SERVER, move |cause| tell.trouble(REACHES_NATS, cause));
    let client = client.await?;
    let bucket = match &remote.bucket {
        Some(bucket) => {
            bucket.make_folder()?;
            Some(Arc::new(Bucket::open(bucket.clone())?))
        }
        None => None,
    };
    let hub = Arc::new(Hub {
        bucket,
        streams: Arc::new(Streams::of(
            jetstream::new(client.clone()),
            names.clone(),
            format!("Faceoff, season {season}"),
        )),
        given_out: Arc::default(),
        handed_in: Arc::default(),
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
        handed_in: Arc::clone(&hub.handed_in),
        streams: Arc::clone(&hub.streams),
    };
    let banned = hub.server.store.worker_bans().await?;
    workers.set_banned(banned.into_iter().map(|ban| (ban.worker, ban.reason)));
    let again = Again {
        workers,
        shutdown: &shutdown,
    };
    tokio::join!(
        again.run("give out work", || hub.give_out(&shutdown)),
        again.run("take in what came of work", || hub.take_in(&shutdown)),
        again.run("keep what waits for it", || hub.keep_waiting(&shutdown)),
        again.run("answer workers", || answers.answer(&shutdown)),
        again.run("hear of games", || answers.show(&shutdown)),
    );
    hub.take_back(hub.given_out.take_all(), None).await;
    Ok(())
}

/// Nobody can begin what a former life of this server has given out; what workers have begun they could not renew while it was away, and may
/// have handed in.
async fn take_over(server: &LocalServer) -> anyhow::Result<()> {
    let (store, now) = (&server.store, server.clock.now());
    let taken_over = async {
        store.give_back_all_of(WAITING, now).await?;
        let lease_s = server.lease_s.max(AT_LEAST_AT_START_S);
        store.renew_leases_of(names::ELSEWHERE, lease_s, now).await
    };
    match taken_over.await {
        Ok(0) => Ok(()),
        Ok(units) => {
            tracing::info!(
                units,
                "workers elsewhere have work since before this server"
            );
            Ok(())
        }
        // They end by themselves.
        Err(error @ StoreError::FullDisk(_)) => {
            tracing::warn!(%error, "the leases of this server's last life stay until they run out");
            Ok(())
        }
        Err(error) => Err(error.into()),
    }
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
                // Where NATS is away, that is told, and not all that follows from it.
                let of_nats = self.workers.is_troubled(REACHES_NATS);
                self.workers.trouble(what, (!of_nats).then_some(&*cause));
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
pub(super) struct Hub {
    client: Client,
    pub(super) streams: Arc<Streams>,
    names: Names,
    pub(super) server: LocalServer,
    pub(super) remote: RemoteConfig,
    pub(super) bucket: Option<Arc<Bucket>>,
    given_out: Arc<AllGivenOut>,
    pub(super) handed_in: Arc<AllHandedIn>,
}

impl Hub {
    async fn give_out(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let (mut stream, mut consumer) = self.streams.orders().await?;
        let mut looked_at = Instant::now();
        // Nothing is claimed in vain.
        if let Some(bucket) = &self.bucket {
            bucket.probe().await?;
        }
        let mut free = self.client.subscribe(self.names.free(ALL)).await?;
        let mut signal = self.server.store.work_signal();
        while !shutdown.is_cancelled() {
            signal.borrow_and_update();
            let late = self.given_out.take_late(Instant::now());
            self.take_back(late, Some(&stream)).await;
            let info = consumer.info().await.context("asking who waits for work")?;
            if looked_at.elapsed() >= LOOK {
                let state = &stream.info().await.context("looking at the orders")?.state;
                anyhow::ensure!(!is_ahead(info, state), LOST_A_PART);
                looked_at = Instant::now();
            }
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
                self.given_out
                    .is_published(lease.nonce, sequence, Instant::now());
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
        let grant = grant_of(&order, &self.remote.like.program);
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
        let jetstream = &self.streams.jetstream;
        let published = jetstream.publish(self.names.orders(), order.into());
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
}
