//! The server's side of remote work: publishes jobs over NATS (a message broker) for free remote slots, and supervises the
//! tasks that answer workers and accept their results.

use super::{
    bucket::{Bucket, BucketConfig},
    connection::NatsConfig,
    grants::grant_for,
    names::{ALL, NOT_STARTED, Names, SERVER},
    pending_results::PendingResults,
    published_jobs::{PublishedJob, PublishedJobs},
    requests::RequestHandler,
    result_checks::ResultChecks,
    streams::{MESSAGES_LOST, Streams, is_ahead},
    unfinished_checks::UnfinishedChecks,
};
use crate::{
    boxed_future,
    local::{LocalServer, to_claim},
    server::{ClaimResult, JobServer},
    slot_supervisor::WorkerConfig,
};
use anyhow::Context as _;
use async_nats::{
    Client,
    jetstream::{self, stream::Stream},
};
use faceoff_episode::Simulator;
use faceoff_live::{LiveState, Workers};
use faceoff_store::{JobFilter, Store, StoreError};
use faceoff_types::{Clock, WorkerName};
use faceoff_wire::{
    grant::GrantKey,
    job::{JobSpec, Lease},
    remote::{RemoteJob, WorkerCapabilities},
};
use futures::StreamExt as _;
use std::{
    path::PathBuf,
    pin::pin,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How often to poll for changes without a signal: published jobs that no worker starts, and jobs that become due.
pub(super) const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Minimum interval between the starts of two attempts.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// An operation that has run this long counts as healthy; requests to an unreachable NATS fail sooner.
const HEALTHY_AFTER: Duration = Duration::from_secs(10);
/// Minimum duration of the workers' leases at the start of the server, seconds: they could not be renewed while it was down.
const MIN_LEASE_AT_START_S: u32 = 60;
/// Key of the problem “NATS is unreachable” in the list of the server's problems, and the cause of all others. A key
/// completes the phrase “the server cannot …”.
const REACH_NATS: &str = "reach NATS";

/// Configuration of remote workers in a server.
#[derive(Debug, Clone)]
pub struct RemoteConfig {
    pub nats: NatsConfig,
    /// Base URL of this server's files for workers (http or https), without a trailing slash.
    pub files_url: String,
    /// Key with which grants are sealed.
    pub key: GrantKey,
    /// Program and runtimes that workers must have.
    pub required: WorkerCapabilities,
    /// Episodes of each shard that are simulated again as a check; 0: no checks.
    pub checked_episodes: u32,
    /// Bucket for the transfer of bundles and recordings, if not over this server's HTTP.
    pub bucket: Option<BucketConfig>,
    /// Folder with the numbers of unfinished checks of results, which survive this process.
    pub checks_dir: PathBuf,
}

impl RemoteConfig {
    pub(super) fn checks(&self, simulator: Arc<dyn Simulator>) -> ResultChecks {
        ResultChecks {
            checked_episodes: self.checked_episodes,
            key: self.key.clone(),
            simulator,
        }
    }
}

/// Publishes jobs and accepts results until `shutdown` is cancelled. While NATS is unreachable no jobs are published, and
/// running jobs continue.
///
/// # Errors
/// If the configuration is invalid, or the database cannot be read at the start.
#[boxed_future]
pub async fn dispatch(
    store: Store,
    live: LiveState,
    clock: Clock,
    config: WorkerConfig,
    remote: RemoteConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let names = Names::new(&remote.nats.name)?;
    let server = LocalServer {
        job_filter: JobFilter::ShardsAndGames,
        ..config.local_server(store, live.clone(), clock)
    };
    resume_leases(&server).await?;
    let season_commitment = server.store.season().await?.commitment;
    let workers = &live.workers;
    workers.enable();
    let problems = workers.clone();
    let client = remote
        .nats
        .connect(SERVER, move |cause| problems.set_problem(REACH_NATS, cause));
    let client = client.await?;
    let bucket = match &remote.bucket {
        Some(bucket) => {
            bucket.create_folder()?;
            Some(Arc::new(Bucket::open(bucket.clone())?))
        }
        None => None,
    };
    let dispatcher = Arc::new(Dispatcher {
        bucket,
        streams: Arc::new(Streams::new(
            jetstream::new(client.clone()),
            names.clone(),
            format!("Faceoff, season {season_commitment}"),
        )),
        unfinished_checks: UnfinishedChecks::open(remote.checks_dir.clone())?,
        published_jobs: Arc::default(),
        pending_results: Arc::default(),
        client,
        names,
        server,
        remote,
    });
    let requests = RequestHandler {
        client: dispatcher.client.clone(),
        names: dispatcher.names.clone(),
        store: dispatcher.server.store.clone(),
        live: live.clone(),
        clock: dispatcher.server.clock.clone(),
        lease_s: dispatcher.server.lease_s,
        required: dispatcher.remote.required.clone(),
        published_jobs: Arc::clone(&dispatcher.published_jobs),
        pending_results: Arc::clone(&dispatcher.pending_results),
        streams: Arc::clone(&dispatcher.streams),
    };
    let supervisor = Supervisor {
        workers,
        shutdown: &shutdown,
    };
    tokio::join!(
        supervisor.run("publish jobs", || dispatcher.publish_jobs(&shutdown)),
        supervisor.run("accept results", || dispatcher.accept_results(&shutdown)),
        supervisor.run("keep the leases of pending results", || dispatcher
            .renew_pending_results(&shutdown)),
        supervisor.run("answer workers", || requests.run(&shutdown)),
        supervisor.run("relay live games", || requests
            .forward_live_games(&shutdown)),
    );
    dispatcher
        .requeue_jobs(dispatcher.published_jobs.take_all(), None)
        .await;
    Ok(())
}

/// Resumes after a restart. Jobs that were published before can no longer be started and are released. Leases of running
/// jobs are renewed, since workers could not renew them, and their results may be pending.
async fn resume_leases(server: &LocalServer) -> anyhow::Result<()> {
    let (store, now) = (&server.store, server.clock.now());
    let resumed = async {
        store.release_leases_of(NOT_STARTED, now).await?;
        let lease_s = server.lease_s.max(MIN_LEASE_AT_START_S);
        store
            .renew_leases_of(WorkerName::REMOTE, lease_s, now)
            .await
    };
    match resumed.await {
        Ok(0) => Ok(()),
        Ok(jobs) => {
            tracing::info!(
                jobs,
                "remote workers have jobs from before the server's start"
            );
            Ok(())
        }
        // These leases expire anyway.
        Err(error @ StoreError::DiskFull(_)) => {
            tracing::warn!(%error, "the leases of this server's previous process remain until they expire");
            Ok(())
        }
        Err(error) => Err(error.into()),
    }
}

/// Runs operations until the shutdown and restarts them when they fail. Only changes are logged; current problems are shown to
/// organisers.
struct Supervisor<'a> {
    workers: &'a Workers,
    shutdown: &'a CancellationToken,
}

impl Supervisor<'_> {
    /// Runs an operation; `operation` completes the phrase “the server cannot …”.
    async fn run<F: Future<Output = anyhow::Result<()>>>(
        &self,
        operation: &str,
        mut run: impl FnMut() -> F,
    ) {
        let mut logged_cause = String::new();
        while !self.shutdown.is_cancelled() {
            let started_at = Instant::now();
            let mut running = pin!(run());
            let result = match tokio::time::timeout(HEALTHY_AFTER, &mut running).await {
                Ok(result) => result,
                Err(_) => {
                    self.workers.set_problem(operation, None);
                    logged_cause.clear();
                    running.await
                }
            };
            let Err(error) = result else {
                continue;
            };
            let cause = format!("{error:#}");
            if cause != logged_cause {
                tracing::error!(cause, "cannot {operation}; trying again");
                // While NATS is unreachable, all other operations fail, too; only this cause is shown.
                let is_nats_down = self.workers.has_problem(REACH_NATS);
                self.workers
                    .set_problem(operation, (!is_nats_down).then_some(&*cause));
                logged_cause = cause;
            }
            tokio::select! {
                () = self.shutdown.cancelled() => {}
                () = tokio::time::sleep_until((started_at + RETRY_INTERVAL).into()) => {}
            }
        }
    }
}

/// Publishes jobs and accepts results.
pub(super) struct Dispatcher {
    client: Client,
    pub(super) streams: Arc<Streams>,
    names: Names,
    pub(super) server: LocalServer,
    pub(super) remote: RemoteConfig,
    pub(super) bucket: Option<Arc<Bucket>>,
    published_jobs: Arc<PublishedJobs>,
    pub(super) pending_results: Arc<PendingResults>,
    pub(super) unfinished_checks: UnfinishedChecks,
}

impl Dispatcher {
    /// Publishes as many jobs as remote slots are waiting for, until the shutdown. It is woken by new jobs, by free slots, and after
    /// [`POLL_INTERVAL`].
    async fn publish_jobs(&self, shutdown: &CancellationToken) -> anyhow::Result<()> {
        let (mut stream, mut consumer) = self.streams.jobs().await?;
        let mut checked_at = Instant::now();
        // Without the bucket, claimed jobs would only be released again.
        if let Some(bucket) = &self.bucket {
            bucket.probe().await?;
        }
        let mut free_slots = self.client.subscribe(self.names.free_slots(ALL)).await?;
        let mut signal = self.server.store.job_signal();
        while !shutdown.is_cancelled() {
            signal.borrow_and_update();
            let not_started_in_time = self.published_jobs.take_late(Instant::now());
            self.requeue_jobs(not_started_in_time, Some(&stream)).await;
            let info = consumer
                .info()
                .await
                .context("reading the number of waiting slots")?;
            if checked_at.elapsed() >= POLL_INTERVAL {
                let state = &stream
                    .info()
                    .await
                    .context("reading the state of the stream of jobs")?
                    .state;
                anyhow::ensure!(!is_ahead(info, state), MESSAGES_LOST);
                checked_at = Instant::now();
            }
            let waiting_slots = u64::try_from(info.num_waiting).unwrap_or_default();
            for _ in 0..waiting_slots.saturating_sub(info.num_pending) {
                if !self.publish_next().await? {
                    break;
                }
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                changed = signal.changed() => changed.context("listening to the queue")?,
                message = free_slots.next() => anyhow::ensure!(message.is_some(), "the connection to NATS has ended"),
                () = tokio::time::sleep(POLL_INTERVAL) => {}
            }
        }
        Ok(())
    }

    /// Claims and publishes one job; returns false if there is none.
    async fn publish_next(&self) -> anyhow::Result<bool> {
        let server = self.server.clone();
        let claimed = tokio::task::spawn_blocking(move || server.claim(NOT_STARTED)).await??;
        let ClaimResult::Job(job) = claimed else {
            return Ok(false);
        };
        let (lease, description) = (job.lease.clone(), job.payload.to_string());
        self.published_jobs
            .add(lease.clone(), description, Instant::now());
        match self.publish(*job).await {
            Ok(sequence) => {
                self.published_jobs
                    .set_published(lease.nonce, sequence, Instant::now());
                Ok(true)
            }
            // The job may have been published nevertheless. Then no worker can start it any more, or one has already.
            Err(error) => {
                let _ = self.published_jobs.take(lease.nonce);
                self.requeue_job(lease).await;
                Err(error)
            }
        }
    }

    /// Publishes a job and returns its sequence number in the stream.
    async fn publish(&self, job: JobSpec) -> anyhow::Result<u64> {
        let grant = grant_for(&job, &self.remote.required.program_blake3);
        let objects = match &self.bucket {
            Some(bucket) => {
                let artifacts = self.server.store.artifacts();
                Some(bucket.create_links(&grant, artifacts).await?)
            }
            None => None,
        };
        let grant = grant.seal(&self.remote.key)?;
        let files_url = self.remote.files_url.clone();
        let message = serde_json::to_vec(&RemoteJob {
            job,
            grant,
            files_url,
            program_blake3: self.remote.required.program_blake3.clone(),
            objects,
        })?;
        let jetstream = &self.streams.jetstream;
        let published = jetstream.publish(self.names.jobs(), message.into());
        let acknowledged = published.await.context("publishing a job")?;
        let acknowledged = acknowledged.await.context("publishing a job")?;
        Ok(acknowledged.sequence)
    }

    /// Puts jobs that no worker has started back into the queue.
    async fn requeue_jobs(&self, jobs: Vec<PublishedJob>, stream: Option<&Stream>) {
        for job in jobs {
            self.requeue_job(job.lease).await;
            // A worker that receives the message before it is deleted cannot start the job any more.
            if let (Some(stream), Some(sequence)) = (stream, job.sequence)
                && let Err(error) = stream.delete_message(sequence).await
            {
                tracing::debug!(%error, "a requeued job could not be removed from the stream");
            }
        }
    }

    async fn requeue_job(&self, lease: Lease) {
        let (store, id, now) = (&self.server.store, lease.job_id, self.server.clock.now());
        let claim = to_claim(&lease, NOT_STARTED);
        match store.release_unstarted(&claim, now).await {
            Ok(true) => tracing::debug!(job = %id, "requeued: not started in time"),
            Ok(false) => {}
            Err(error) => {
                tracing::warn!(job = %id, %error, "a job could not be requeued; its lease will expire");
            }
        }
    }
}
