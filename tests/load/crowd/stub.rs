//! A worker with one slot that speaks with the server as `faceoff worker` does, word for word, and plays nothing: it sleeps.

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
    remote::{Answer, Ask, Introduction, Outcome, RemoteOrder, RemoteOutcome},
    work::{Assignment, Keeps, Lease, ShardSpec, WorkReport},
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

/// These are a worker's own (`remote/far_server.rs` and `remote/connection.rs` of `faceoff-worker`).
const ANSWER: Duration = Duration::from_secs(5);
const OPEN_FOR: Duration = Duration::from_secs(5);
const REST: Duration = Duration::from_secs(2);
const RENEWS_EVERY: Duration = Duration::from_millis(500);
const SLOT: &str = "slot-0";
/// The server's name where streams and subjects have it: the default.
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
/// What fails more often than this is broken, and not busy.
const MOST_FAILURES: u32 = 100;
/// Of each but the largest.
const SMALL_BYTES: usize = 1024;

pub(crate) struct Stub {
    number: usize,
    name: String,
    own: Introduction,
    client: Client,
    jetstream: jetstream::Context,
    http: reqwest::Client,
    recording: Bytes,
    evaluations: Arc<Evaluations>,
    /// The bundle that it has, as a worker keeps the one that it used last.
    bundle: String,
}

/// What one phase asks of each worker.
pub(crate) struct Plan {
    /// How long a shard is "played".
    pub(crate) sleep: Duration,
    /// Each shard's own time differs from that by up to this part of it.
    pub(crate) spread: f64,
    pub(crate) share: Share,
}

/// Which shards a worker plays.
pub(crate) enum Share {
    Each(u32),
    /// Whoever is free takes the next of so many.
    Common(AtomicI64),
}

impl Share {
    fn has_more(&self, done: usize) -> bool {
        match self {
            Self::Each(rounds) => u32::try_from(done).is_ok_and(|done| done < *rounds),
            Self::Common(left) => left.fetch_sub(1, Ordering::Relaxed) > 0,
        }
    }
}

/// What a worker met, in seconds where it is a time: an entry for each shard.
#[derive(Default)]
pub(crate) struct Tally {
    /// From being free to an order.
    pub(crate) order_s: Vec<f64>,
    /// From an order to the answer that it may begin.
    pub(crate) begin_s: Vec<f64>,
    /// To store the recording's files.
    pub(crate) files_s: Vec<f64>,
    /// To hand in what came of it: until NATS has stored it.
    pub(crate) hand_in_s: Vec<f64>,
    /// Of all shards together, asleep.
    pub(crate) slept_s: f64,
    pub(crate) trouble: Trouble,
}

/// What a worker would have tried again, too.
#[derive(Default)]
pub(crate) struct Trouble {
    /// Questions and requests for orders that failed or were refused.
    pub(crate) orders: u32,
    /// Renewals that were not answered with yes or no.
    pub(crate) renewals: u32,
    /// Files that the server had no time for.
    pub(crate) files: u32,
    /// Outcomes that NATS did not store at once.
    pub(crate) outcomes: u32,
    /// Leases that were lost.
    pub(crate) lost: u32,
}

impl Tally {
    pub(crate) fn add(&mut self, other: Self) {
        self.order_s.extend(other.order_s);
        self.begin_s.extend(other.begin_s);
        self.files_s.extend(other.files_s);
        self.hand_in_s.extend(other.hand_in_s);
        self.slept_s += other.slept_s;
        self.trouble.orders += other.trouble.orders;
        self.trouble.renewals += other.trouble.renewals;
        self.trouble.files += other.trouble.files;
        self.trouble.outcomes += other.trouble.outcomes;
        self.trouble.lost += other.trouble.lost;
    }
}

/// An order that it may work at.
struct Begun {
    lease: Lease,
    grant: String,
    files: String,
    part_of: Uuid,
    bundle: String,
    spec: ShardSpec,
    recording: String,
    /// When the order came.
    came: Instant,
}

impl Stub {
    pub(crate) async fn connect(
        number: usize,
        nats: &str,
        own: Introduction,
        recording_bytes: usize,
        evaluations: Arc<Evaluations>,
    ) -> anyhow::Result<Self> {
        let name = format!("stub-{number}");
        let client = ConnectOptions::new()
            .name(&name)
            .custom_inbox_prefix(format!("_INBOX.{SERVER}.{name}"))
            .request_timeout(Some(ANSWER))
            .connect(nats)
            .await
            .context("connecting to NATS")?;
        // Nothing here speaks TLS.
        let nobody = rustls::ClientConfig::builder()
            .with_root_certificates(rustls::RootCertStore::empty())
            .with_no_client_auth();
        Ok(Self {
            number,
            name,
            own,
            jetstream: jetstream::new(client.clone()),
            client,
            http: reqwest::Client::builder()
                .tls_backend_preconfigured(nobody)
                .build()?,
            recording: Bytes::from(vec![0; recording_bytes]),
            evaluations,
            bundle: String::new(),
        })
    }

    /// Works as the plan asks, and comes back with what it met.
    pub(crate) async fn work(mut self, plan: Arc<Plan>) -> anyhow::Result<(Self, Tally)> {
        let mut tally = Tally::default();
        while plan.share.has_more(tally.order_s.len()) {
            // A lease that is lost is no shard: the server gives it to another, and this worker asks for the next.
            while !self.shard(&plan, &mut tally).await? {
                tally.trouble.lost += 1;
            }
        }
        Ok((self, tally))
    }

    /// Was one played and handed in?
    async fn shard(&mut self, plan: &Plan, tally: &mut Tally) -> anyhow::Result<bool> {
        let free = Instant::now();
        let order = self.next(&mut tally.trouble).await?;
        let begun = Instant::now();
        self.fetch_bundle(&order).await?;
        let sleep = plan
            .sleep
            .mul_f64(1.0 + plan.spread * self.draw(tally.order_s.len()));
        let played = async {
            tokio::time::sleep(sleep).await;
            let slept = Instant::now();
            let stored = self.store(&order).await?;
            anyhow::Ok(stored.map(|failed| (slept.elapsed(), failed)))
        };
        let mut renewals = 0;
        let kept = self.keep(&order, sleep, &mut renewals);
        let played = tokio::select! {
            played = played => played?,
            () = kept => None,
        };
        tally.trouble.renewals += renewals;
        let Some((files, failed)) = played else {
            return Ok(false);
        };
        let hands_in = Instant::now();
        tally.trouble.outcomes += self.hand_in(&order).await?;
        tally
            .order_s
            .push(order.came.duration_since(free).as_secs_f64());
        tally
            .begin_s
            .push(begun.duration_since(order.came).as_secs_f64());
        tally.files_s.push(files.as_secs_f64());
        tally.hand_in_s.push(hands_in.elapsed().as_secs_f64());
        tally.slept_s += sleep.as_secs_f64();
        tally.trouble.files += failed;
        Ok(true)
    }

    /// The next order that it may begin, however long that takes.
    async fn next(&self, trouble: &mut Trouble) -> anyhow::Result<Begun> {
        let mut failed = 0;
        loop {
            match self.ask_for_work().await {
                Ok(Some(begun)) => return Ok(begun),
                // Nothing came while the request was open, or another has it.
                Ok(None) => {}
                Err(error) => {
                    failed += 1;
                    trouble.orders += 1;
                    if failed == MOST_FAILURES {
                        return Err(error.context("asking for work, again and again"));
                    }
                    tokio::time::sleep(REST).await;
                }
            }
        }
    }

    async fn ask_for_work(&self) -> anyhow::Result<Option<Begun>> {
        match self.ask(&Ask::MayWork(self.own.clone())).await? {
            Answer::Yes => {}
            other => anyhow::bail!("the server gives no work: {other:?}"),
        }
        let stream = format!("{SERVER}-orders");
        let consumer = self.jetstream.get_consumer_from_stream("workers", stream);
        let consumer: PullConsumer = consumer
            .await
            .map_err(|error| anyhow::anyhow!("asking for orders: {error}"))?;
        let mut orders = consumer
            .batch()
            .max_messages(1)
            .expires(OPEN_FOR)
            .messages()
            .await
            .context("asking for an order")?;
        let free = format!("{SERVER}.free.{}", self.name);
        self.client.publish(free, Bytes::new()).await?;
        let Some(message) = orders.next().await else {
            return Ok(None);
        };
        let came = Instant::now();
        let message = message.map_err(|error| anyhow::anyhow!("waiting for an order: {error}"))?;
        message
            .ack()
            .await
            .map_err(|error| anyhow::anyhow!("acknowledging an order: {error}"))?;
        let RemoteOrder {
            order,
            grant,
            files,
            ..
        } = serde_json::from_slice(&message.payload).context("an order")?;
        let mut lease = order.lease;
        let begin = Ask::Begin {
            lease: lease.clone(),
            slot: SLOT.to_owned(),
        };
        if self.ask(&begin).await? != Answer::Yes {
            return Ok(None);
        }
        lease.slot = format!("remote/{}/{SLOT}", self.name);
        let Assignment::Play {
            part_of,
            agent,
            spec,
            keeps: Keeps::Recording(recording),
        } = order.assignment
        else {
            anyhow::bail!(
                "the season has nothing but evaluations: {}",
                order.assignment
            );
        };
        Ok(Some(Begun {
            lease,
            grant,
            files,
            part_of,
            bundle: agent.bundle.blake3,
            spec,
            recording,
            came,
        }))
    }

    async fn ask(&self, ask: &Ask) -> anyhow::Result<Answer> {
        let question = serde_json::to_vec(ask)?;
        let subject = format!("{SERVER}.asks.{}", self.name);
        let answer = self.client.request(subject, question.into());
        let answer = answer.await.context("asking the server")?;
        serde_json::from_slice(&answer.payload).context("the server's answer")
    }

    async fn fetch_bundle(&mut self, order: &Begun) -> anyhow::Result<()> {
        if self.bundle != order.bundle {
            let url = format!("{}/work/bundles/{}", order.files, order.bundle);
            let request = self.http.get(url);
            let request = request.header(header::AUTHORIZATION, format!("Grant {}", order.grant));
            let answer = request.send().await?.error_for_status()?;
            let _archive = answer.bytes().await?;
            self.bundle.clone_from(&order.bundle);
        }
        Ok(())
    }

    /// Stores a recording's files; how often that failed, or nothing if the order is no longer this worker's.
    async fn store(&self, order: &Begun) -> anyhow::Result<Option<u32>> {
        let mut failed = 0;
        for (index, name) in FILES.into_iter().enumerate() {
            let body = match index {
                0 => self.recording.clone(),
                _ => Bytes::from_static(&[0; SMALL_BYTES]),
            };
            loop {
                let request = self.http.put(format!("{}/work/files/{name}", order.files));
                let request =
                    request.header(header::AUTHORIZATION, format!("Grant {}", order.grant));
                match request.body(body.clone()).send().await {
                    Ok(answer) if answer.status() == StatusCode::FORBIDDEN => return Ok(None),
                    Ok(answer) if !is_busy(answer.status()) => {
                        answer.error_for_status().context("storing a file")?;
                        break;
                    }
                    Err(error) if failed == MOST_FAILURES => {
                        return Err(error).context("storing a file, again and again");
                    }
                    Ok(_) | Err(_) => failed += 1,
                }
                tokio::time::sleep(REST).await;
            }
        }
        Ok(Some(failed))
    }

    /// Renews as often as a worker does, and tells how far it is, until the lease is lost.
    async fn keep(&self, order: &Begun, sleep: Duration, unanswered: &mut u32) {
        let began = Instant::now();
        let episodes = order.spec.episodes.len();
        loop {
            tokio::time::sleep(RENEWS_EVERY).await;
            let part = match sleep.is_zero() {
                true => 1.0,
                false => began.elapsed().div_duration_f64(sleep).min(1.0),
            };
            let renew = Ask::Renew {
                lease: order.lease.clone(),
                episodes_done: (part * episodes as f64) as u32,
                trouble: None,
            };
            match self.ask(&renew).await {
                Ok(Answer::Yes) => {}
                Ok(Answer::No { .. }) => return,
                Ok(Answer::Unknown) | Err(_) => *unanswered += 1,
            }
        }
    }

    /// Hands in what came of an order; how often that failed.
    async fn hand_in(&self, order: &Begun) -> anyhow::Result<u32> {
        let ends = self.evaluations.ends(order.part_of);
        if ends {
            self.evaluations.others_are_handed_in(order.part_of).await;
        }
        let report = WorkReport::Play {
            outcomes: outcomes(&order.spec, ends),
            log: String::new(),
            stopped_by_faults: ends,
            recording: Some(order.recording.clone()),
        };
        let outcome = RemoteOutcome {
            lease: order.lease.clone(),
            grant: order.grant.clone(),
            outcome: Outcome::Done {
                report: Box::new(report),
            },
        };
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", outcome.id());
        let payload = Bytes::from(serde_json::to_vec(&outcome)?);
        let largest = self.client.max_payload();
        ensure!(
            payload.len() <= largest,
            "an outcome has {} bytes, and NATS takes {largest}",
            payload.len()
        );
        let subject = format!("{SERVER}.outcomes.{}", self.name);
        let began = Instant::now();
        let within = Duration::from_secs(order.lease.duration_s.into());
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
                Err(error) if began.elapsed() >= within => {
                    return Err(error).context("handing in what came of an order");
                }
                Err(_) => {
                    failed += 1;
                    tokio::time::sleep(REST).await;
                }
            }
        };
        self.evaluations.handed_in(order.part_of);
        let handed_in = Ask::HandedIn {
            lease: order.lease.clone(),
            episodes_done: order.spec.episodes.end - order.spec.episodes.start,
            sequence,
        };
        // That the server keeps the lease is of use, and no more.
        let _ = self.ask(&handed_in).await;
        Ok(failed)
    }

    /// Between -1 and 1, drawn for its shard of this number: the same in each run.
    fn draw(&self, shard: usize) -> f64 {
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

/// Of episodes in which nothing happened, or of an agent that broke a limit in the last of them.
fn outcomes(spec: &ShardSpec, faulty: bool) -> Vec<EpisodeOutcome> {
    let outcome = |episode| {
        let fault = (faulty && episode + 1 == spec.episodes.end).then(|| AgentFault {
            fault: AgentFaultKind::TimedOut {
                phase: Phase::Reset,
                limit_s: 1.0,
            },
            contest: spec.task.into(),
            episode: Some(episode),
            step: None,
            line: None,
        });
        let (steps, end, computation_time) = match fault {
            Some(_) => (0, EpisodeEnd::AgentFault, ComputationTime::default()),
            None => {
                let usual = ComputationTime {
                    mean_s: 0.000_512_25,
                    max_s: 0.001_953_125,
                };
                (EPISODE_STEPS, EpisodeEnd::Horizon, usual)
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
