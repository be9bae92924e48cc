//! A simulated worker with one slot (a place for one running job). It uses the protocol of `faceoff worker`, but sleeps instead of
//! running agents.

use crate::evaluations::Evaluations;
use anyhow::{Context as _, ensure};
use async_nats::{
    Client, ConnectOptions, HeaderMap,
    jetstream::{self, consumer::PullConsumer},
};
use bytes::Bytes;
use faceoff_types::{
    AgentFault, AgentFaultKind, ComputationTime, EPISODE_STEPS, EpisodeEnd, EpisodeOutcome, Phase,
    Violations,
};
use faceoff_wire::{
    job::{JobPayload, JobReport, Lease, OutputFiles, ShardSpec},
    remote::{
        RemoteJob, RemoteJobEnd, ResultMessage, WorkerCapabilities, WorkerRequest, WorkerResponse,
    },
};
use futures::StreamExt as _;
use reqwest::{StatusCode, header};
use std::{
    sync::{
        Arc,
        atomic::{AtomicI64, Ordering},
    },
    time::{Duration, Instant},
};
use uuid::Uuid;

// The four times are those of `faceoff worker` (`remote/` in `crates/faceoff-worker`).
/// How long a worker waits for the server's response to a request.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(5);
/// How long a worker's request for a job waits for one; then it sends the next request.
const PULL_EXPIRY: Duration = Duration::from_secs(5);
/// Pause after a failure.
const RETRY_DELAY: Duration = Duration::from_secs(2);
/// How often a worker renews its *lease*, the right to run a job for a time.
const RENEWAL_INTERVAL: Duration = Duration::from_millis(500);
const SLOT: &str = "slot-0";
/// The server's name in streams and subjects: the default.
const SERVER: &str = "faceoff";
/// The files of a shard's recording, the largest first.
const FILES: [&str; 6] = [
    "steps.parquet",
    "episodes.parquet",
    "clips",
    "agent.log",
    "report.json",
    "shard.json",
];
/// After more failures than this the server counts as faulty, not as busy.
const MAX_FAILURES: u32 = 100;
/// The size of each file but the largest.
const SMALL_BYTES: usize = 1024;

/// A worker that is connected to NATS.
pub(crate) struct SimulatedWorker {
    number: usize,
    name: String,
    capabilities: WorkerCapabilities,
    client: Client,
    jetstream: jetstream::Context,
    http: reqwest::Client,
    recording: Bytes,
    evaluations: Arc<Evaluations>,
    /// The hash of the downloaded bundle: like a worker, it keeps the last one.
    bundle: String,
}

/// The work of one phase.
pub(crate) struct Plan {
    /// The mean duration of a shard, during which the worker sleeps.
    pub(crate) sleep: Duration,
    /// The largest relative deviation of a shard's duration.
    pub(crate) spread: f64,
    pub(crate) workload: Workload,
}

/// The number of shards of a phase.
pub(crate) enum Workload {
    /// This number of shards for each worker.
    PerWorker(u32),
    /// The remaining shards of all workers together.
    Shared(AtomicI64),
}

impl Workload {
    fn has_more(&self, done: usize) -> bool {
        match self {
            Self::PerWorker(rounds) => u32::try_from(done).is_ok_and(|done| done < *rounds),
            Self::Shared(remaining) => remaining.fetch_sub(1, Ordering::Relaxed) > 0,
        }
    }
}

/// Measurements of a worker, in seconds, with an entry for each shard.
#[derive(Default)]
pub(crate) struct Measurements {
    /// From being free to receiving a job.
    pub(crate) job_s: Vec<f64>,
    /// From receiving the job to the permission to start it.
    pub(crate) start_s: Vec<f64>,
    /// Storing the files of the recording.
    pub(crate) files_s: Vec<f64>,
    /// Sending the result, until NATS has stored it.
    pub(crate) result_s: Vec<f64>,
    /// The total time of all shards in which the worker slept instead of running an agent.
    pub(crate) slept_s: f64,
    pub(crate) retries: Retries,
}

/// Requests that were repeated, as a worker repeats them.
#[derive(Default)]
pub(crate) struct Retries {
    /// Requests for jobs that failed or were refused.
    pub(crate) jobs: u32,
    /// Lease renewals that were neither accepted nor refused.
    pub(crate) renewals: u32,
    /// Files that the busy server refused.
    pub(crate) files: u32,
    /// Results that NATS did not store at once.
    pub(crate) results: u32,
    /// Leases that were lost.
    pub(crate) lost: u32,
}

impl Measurements {
    pub(crate) fn add(&mut self, other: Self) {
        self.job_s.extend(other.job_s);
        self.start_s.extend(other.start_s);
        self.files_s.extend(other.files_s);
        self.result_s.extend(other.result_s);
        self.slept_s += other.slept_s;
        self.retries.jobs += other.retries.jobs;
        self.retries.renewals += other.retries.renewals;
        self.retries.files += other.retries.files;
        self.retries.results += other.retries.results;
        self.retries.lost += other.retries.lost;
    }
}

/// A job that the server has allowed this worker to start.
struct StartedJob {
    lease: Lease,
    /// The permission for the job's files.
    grant: String,
    files_url: String,
    /// The id of the evaluation.
    evaluation: Uuid,
    /// The hash of the agent's bundle.
    bundle: String,
    spec: ShardSpec,
    /// The name of the recording on the server.
    recording: String,
    /// When the job was received.
    received_at: Instant,
}

impl SimulatedWorker {
    pub(crate) async fn connect(
        number: usize,
        nats: &str,
        capabilities: WorkerCapabilities,
        recording_bytes: usize,
        evaluations: Arc<Evaluations>,
    ) -> anyhow::Result<Self> {
        let name = format!("stub-{number}");
        let client = ConnectOptions::new()
            .name(&name)
            .custom_inbox_prefix(format!("_INBOX.{SERVER}.{name}"))
            .request_timeout(Some(RESPONSE_TIMEOUT))
            .connect(nats)
            .await
            .context("connecting to NATS")?;
        // The program does not use TLS.
        let no_tls = rustls::ClientConfig::builder()
            .with_root_certificates(rustls::RootCertStore::empty())
            .with_no_client_auth();
        Ok(Self {
            number,
            name,
            capabilities,
            jetstream: jetstream::new(client.clone()),
            client,
            http: reqwest::Client::builder()
                .tls_backend_preconfigured(no_tls)
                .build()?,
            recording: Bytes::from(vec![0; recording_bytes]),
            evaluations,
            bundle: String::new(),
        })
    }

    /// Runs the shards of a plan. Returns itself and its measurements.
    pub(crate) async fn work(mut self, plan: Arc<Plan>) -> anyhow::Result<(Self, Measurements)> {
        let mut measurements = Measurements::default();
        while plan.workload.has_more(measurements.job_s.len()) {
            // A shard whose lease is lost does not count: the server gives it to another worker.
            while !self.run_shard(&plan, &mut measurements).await? {
                measurements.retries.lost += 1;
            }
        }
        Ok((self, measurements))
    }

    /// Runs a shard and sends its result. Returns false if the lease was lost.
    async fn run_shard(
        &mut self,
        plan: &Plan,
        measurements: &mut Measurements,
    ) -> anyhow::Result<bool> {
        let free_since = Instant::now();
        let job = self.next_job(&mut measurements.retries).await?;
        let started = Instant::now();
        self.fetch_bundle(&job).await?;
        let sleep = plan
            .sleep
            .mul_f64(1.0 + plan.spread * self.random_offset(measurements.job_s.len()));
        let played = async {
            tokio::time::sleep(sleep).await;
            let slept_until = Instant::now();
            let stored = self.store_files(&job).await?;
            anyhow::Ok(stored.map(|failures| (slept_until.elapsed(), failures)))
        };
        let mut renewals = 0;
        let lease_lost = self.renew_lease(&job, sleep, &mut renewals);
        let played = tokio::select! {
            played = played => played?,
            () = lease_lost => None,
        };
        measurements.retries.renewals += renewals;
        let Some((files_duration, failures)) = played else {
            return Ok(false);
        };
        let sending_since = Instant::now();
        measurements.retries.results += self.send_result(&job).await?;
        measurements
            .job_s
            .push(job.received_at.duration_since(free_since).as_secs_f64());
        measurements
            .start_s
            .push(started.duration_since(job.received_at).as_secs_f64());
        measurements.files_s.push(files_duration.as_secs_f64());
        measurements
            .result_s
            .push(sending_since.elapsed().as_secs_f64());
        measurements.slept_s += sleep.as_secs_f64();
        measurements.retries.files += failures;
        Ok(true)
    }

    /// The next job that this worker may start. There is no time limit.
    async fn next_job(&self, retries: &mut Retries) -> anyhow::Result<StartedJob> {
        let mut failed = 0;
        loop {
            match self.request_job().await {
                Ok(Some(started)) => return Ok(started),
                // No job came before the request expired, or another worker has it.
                Ok(None) => {}
                Err(error) => {
                    failed += 1;
                    retries.jobs += 1;
                    if failed == MAX_FAILURES {
                        return Err(error.context("requesting a job failed too often"));
                    }
                    tokio::time::sleep(RETRY_DELAY).await;
                }
            }
        }
    }

    async fn request_job(&self) -> anyhow::Result<Option<StartedJob>> {
        match self
            .request(&WorkerRequest::Register(self.capabilities.clone()))
            .await?
        {
            WorkerResponse::Accepted => {}
            other => anyhow::bail!("the server refuses this worker: {other:?}"),
        }
        let stream = format!("{SERVER}-orders");
        let consumer = self.jetstream.get_consumer_from_stream("workers", stream);
        let consumer: PullConsumer = consumer
            .await
            .map_err(|error| anyhow::anyhow!("opening the consumer of jobs: {error}"))?;
        let mut jobs = consumer
            .batch()
            .max_messages(1)
            .expires(PULL_EXPIRY)
            .messages()
            .await
            .context("requesting a job")?;
        let free = format!("{SERVER}.free.{}", self.name);
        self.client.publish(free, Bytes::new()).await?;
        let Some(message) = jobs.next().await else {
            return Ok(None);
        };
        let received_at = Instant::now();
        let message = message.map_err(|error| anyhow::anyhow!("waiting for a job: {error}"))?;
        message
            .ack()
            .await
            .map_err(|error| anyhow::anyhow!("acknowledging a job: {error}"))?;
        let RemoteJob {
            job,
            grant,
            files_url,
            ..
        } = serde_json::from_slice(&message.payload).context("parsing a job")?;
        let mut lease = job.lease;
        let start = WorkerRequest::StartJob {
            lease: lease.clone(),
            slot: SLOT.to_owned(),
        };
        if self.request(&start).await? != WorkerResponse::Accepted {
            return Ok(None);
        }
        lease.holder = format!("remote/{}/{SLOT}", self.name);
        let JobPayload::Shard {
            part_of,
            agent,
            spec,
            output: OutputFiles::Recording(recording),
        } = job.payload
        else {
            anyhow::bail!("expected a shard with a recording, got {}", job.payload);
        };
        Ok(Some(StartedJob {
            lease,
            grant,
            files_url,
            evaluation: part_of,
            bundle: agent.bundle.blake3,
            spec,
            recording,
            received_at,
        }))
    }

    async fn request(&self, request: &WorkerRequest) -> anyhow::Result<WorkerResponse> {
        let payload = serde_json::to_vec(request)?;
        let subject = format!("{SERVER}.asks.{}", self.name);
        let response = self.client.request(subject, payload.into());
        let response = response.await.context("sending a request to the server")?;
        serde_json::from_slice(&response.payload).context("parsing the server's response")
    }

    async fn fetch_bundle(&mut self, job: &StartedJob) -> anyhow::Result<()> {
        if self.bundle != job.bundle {
            let url = format!("{}/work/bundles/{}", job.files_url, job.bundle);
            let request = self.http.get(url);
            let request = request.header(header::AUTHORIZATION, format!("Grant {}", job.grant));
            let response = request.send().await?.error_for_status()?;
            let _archive = response.bytes().await?;
            self.bundle.clone_from(&job.bundle);
        }
        Ok(())
    }

    /// Stores the files of a recording. Returns the number of failures, or `None` if the worker does not hold the lease any more.
    async fn store_files(&self, job: &StartedJob) -> anyhow::Result<Option<u32>> {
        let mut failed = 0;
        for (index, name) in FILES.into_iter().enumerate() {
            let body = match index {
                0 => self.recording.clone(),
                _ => Bytes::from_static(&[0; SMALL_BYTES]),
            };
            loop {
                let request = self
                    .http
                    .put(format!("{}/work/files/{name}", job.files_url));
                let request = request.header(header::AUTHORIZATION, format!("Grant {}", job.grant));
                match request.body(body.clone()).send().await {
                    Ok(response) if response.status() == StatusCode::FORBIDDEN => return Ok(None),
                    Ok(response) if !is_busy(response.status()) => {
                        response.error_for_status().context("storing a file")?;
                        break;
                    }
                    Err(error) if failed == MAX_FAILURES => {
                        return Err(error).context("storing a file failed too often");
                    }
                    Ok(_) | Err(_) => failed += 1,
                }
                tokio::time::sleep(RETRY_DELAY).await;
            }
        }
        Ok(Some(failed))
    }

    /// Renews the lease as often as a worker does, with the progress. Returns when the lease is lost.
    async fn renew_lease(&self, job: &StartedJob, sleep: Duration, unanswered: &mut u32) {
        let started = Instant::now();
        let episodes = job.spec.episodes.len();
        loop {
            tokio::time::sleep(RENEWAL_INTERVAL).await;
            let progress = match sleep.is_zero() {
                true => 1.0,
                false => started.elapsed().div_duration_f64(sleep).min(1.0),
            };
            let renew = WorkerRequest::RenewLease {
                lease: job.lease.clone(),
                episodes_done: (progress * episodes as f64) as u32,
                send_problem: None,
            };
            match self.request(&renew).await {
                Ok(WorkerResponse::Accepted) => {}
                Ok(WorkerResponse::Refused { .. }) => return,
                Ok(WorkerResponse::Unavailable) | Err(_) => *unanswered += 1,
            }
        }
    }

    /// Sends the result of a job. Returns the number of failed attempts.
    async fn send_result(&self, job: &StartedJob) -> anyhow::Result<u32> {
        let is_last = self.evaluations.record_played(job.evaluation);
        if is_last {
            self.evaluations
                .wait_for_other_results(job.evaluation)
                .await;
        }
        let report = JobReport::Shard {
            outcomes: outcomes(&job.spec, is_last),
            log: String::new(),
            stopped_by_faults: is_last,
            recording: Some(job.recording.clone()),
        };
        let result = ResultMessage {
            lease: job.lease.clone(),
            grant: job.grant.clone(),
            end: RemoteJobEnd::Done {
                report: Box::new(report),
            },
        };
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", result.id());
        let payload = Bytes::from(serde_json::to_vec(&result)?);
        let max_bytes = self.client.max_payload();
        ensure!(
            payload.len() <= max_bytes,
            "a result has {} bytes, but NATS accepts at most {max_bytes}",
            payload.len()
        );
        let subject = format!("{SERVER}.outcomes.{}", self.name);
        let started = Instant::now();
        let time_limit = Duration::from_secs(job.lease.duration_s.into());
        let mut failed = 0;
        let sequence = loop {
            let sent = async {
                let sent = self.jetstream.publish_with_headers(
                    subject.clone(),
                    headers.clone(),
                    payload.clone(),
                );
                anyhow::Ok(sent.await?.await?)
            };
            match sent.await {
                Ok(stored) => break stored.sequence,
                Err(error) if started.elapsed() >= time_limit => {
                    return Err(error).context("sending the result of a job");
                }
                Err(_) => {
                    failed += 1;
                    tokio::time::sleep(RETRY_DELAY).await;
                }
            }
        };
        self.evaluations.record_result(job.evaluation);
        let pending = WorkerRequest::ResultPending {
            lease: job.lease.clone(),
            episodes_done: job.spec.episodes.end - job.spec.episodes.start,
            sequence,
        };
        // This only asks the server to keep the lease; a failure does no harm.
        let _ = self.request(&pending).await;
        Ok(failed)
    }

    /// A pseudo-random number between -1 and 1 for a shard, the same in each run.
    fn random_offset(&self, shard: usize) -> f64 {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(self.number as u64).to_le_bytes());
        hasher.update(&(shard as u64).to_le_bytes());
        let mut bytes = [0; 4];
        hasher.finalize_xof().fill(&mut bytes);
        f64::from(u32::from_le_bytes(bytes)) / f64::from(u32::MAX) * 2.0 - 1.0
    }
}

fn is_busy(status: StatusCode) -> bool {
    status == StatusCode::TOO_MANY_REQUESTS || status == StatusCode::SERVICE_UNAVAILABLE
}

/// Outcomes of uneventful episodes, with a fault in the last one if `has_fault`.
fn outcomes(spec: &ShardSpec, has_fault: bool) -> Vec<EpisodeOutcome> {
    let outcome = |episode| {
        let fault = (has_fault && episode + 1 == spec.episodes.end).then(|| AgentFault {
            fault: AgentFaultKind::TimedOut {
                phase: Phase::Reset,
                limit_s: 1.0,
            },
            agent_task: spec.task.into(),
            episode: Some(episode),
            step: None,
            line: None,
        });
        let (steps, end, computation_time) = match fault {
            Some(_) => (0, EpisodeEnd::AGENT_FAULT, ComputationTime::default()),
            None => {
                let usual = ComputationTime {
                    mean_s: 0.000_512_25,
                    max_s: 0.001_953_125,
                };
                (EPISODE_STEPS, EpisodeEnd::HORIZON, usual)
            }
        };
        EpisodeOutcome {
            task: spec.task,
            episode,
            steps,
            end,
            success: false,
            violations: Violations::default(),
            computation_time,
            fault,
        }
    };
    spec.episodes.clone().map(outcome).collect()
}
