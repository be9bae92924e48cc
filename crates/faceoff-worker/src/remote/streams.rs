//! The streams and consumers of a server. Old versions of NATS silently ignore unknown settings, so the actual settings are
//! compared with the requested ones.

use super::{
    connection::REQUEST_TIMEOUT,
    names::{ALL, JOBS_CONSUMER, Names, RESULTS_CONSUMER},
};
use anyhow::Context as _;
use async_nats::{
    header::NATS_MESSAGE_ID,
    jetstream::{
        self,
        consumer::{self, AckPolicy, PullConsumer, pull},
        stream::{self, DiscardPolicy, RawMessageErrorKind, RetentionPolicy, Stream},
    },
};
use faceoff_wire::{job::Lease, remote::ResultMessage};
use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

/// Maximum number of jobs in the stream; there are never more than free slots.
const MAX_JOBS: i64 = 100_000;
/// Maximum size of all pending results, in bytes.
const MAX_RESULT_BYTES: i64 = 1 << 30;
/// Time within which NATS drops repeated results. The server commits a result once in any case.
const DUPLICATE_WINDOW: Duration = Duration::from_secs(120);
/// Time after which a result that the server has not acknowledged is delivered again.
const ACK_WAIT: Duration = Duration::from_secs(60);
/// The error for a stream that has fewer messages than its consumer assumes. With a new consumer the remaining messages are
/// delivered again, which has no effect.
pub(super) const MESSAGES_LOST: &str =
    "NATS has lost stored messages: the consumer is created again";
/// Maximum number of slots that wait for a job.
const MAX_WAITING: i64 = 8192;

/// The streams of a server.
pub(super) struct Streams {
    pub(super) jetstream: jetstream::Context,
    pub(super) names: Names,
    /// Identifies the server; stored as the description of the streams.
    pub(super) owner: String,
    /// Whether the streams of jobs and of results are known to belong to this server. Otherwise workers are not answered,
    /// since they belong to another server.
    are_owned: [AtomicBool; 2],
}

impl Streams {
    pub(super) const fn new(jetstream: jetstream::Context, names: Names, owner: String) -> Self {
        Self {
            jetstream,
            names,
            owner,
            are_owned: [const { AtomicBool::new(false) }; 2],
        }
    }

    pub(super) fn are_owned(&self) -> bool {
        let is_owned = |known: &AtomicBool| known.load(Ordering::Relaxed);
        self.are_owned.iter().all(is_owned)
    }

    pub(super) async fn jobs(&self) -> anyhow::Result<(Stream, PullConsumer)> {
        let stream = self.stream(self.jobs_config(), &self.are_owned[0]).await?;
        let consumer = consumer(&stream, jobs_consumer()).await?;
        Ok((stream, consumer))
    }

    pub(super) async fn results(&self) -> anyhow::Result<PullConsumer> {
        // The owner of the first stream owns the second. Otherwise two new servers could create one each.
        self.owned_stream(&self.jobs_config(), &self.are_owned[0])
            .await?;
        let stream = self.stream(self.results_config(), &self.are_owned[1]);
        consumer(&stream.await?, results_consumer()).await
    }

    /// Checks that the stream exists and has no results that are never delivered; such failures cause no other error.
    /// `undelivered` is the first such result of the previous check.
    ///
    /// # Errors
    /// If stream and consumer must be set up again.
    pub(super) async fn check_results(
        &self,
        consumer: &mut PullConsumer,
        undelivered: &mut Option<u64>,
    ) -> anyhow::Result<()> {
        let name = self.names.results_stream();
        let doing = || format!("checking the stream {name}");
        let stream = self.jetstream.get_stream(&name).await;
        let stream = stream.with_context(doing)?;
        let state = &stream.cached_info().state;
        let known = consumer.info().await.with_context(doing)?;
        let is_idle = known.num_pending == 0 && known.num_ack_pending == 0;
        let first = (is_idle && state.messages > 0).then_some(state.first_sequence);
        // A result that was just acknowledged looks the same, but only once.
        anyhow::ensure!(first.is_none() || first != *undelivered, MESSAGES_LOST);
        *undelivered = first;
        Ok(())
    }

    /// Is the result of this lease stored at this sequence number? NATS may acknowledge a message before it is on disk, and
    /// then lose it.
    pub(super) async fn has_result(&self, lease: &Lease, sequence: u64) -> anyhow::Result<bool> {
        let name = self.names.results_stream();
        let stream = self.jetstream.get_stream_no_info(&name).await?;
        // The client has no timeout of its own while NATS is unreachable.
        let response =
            tokio::time::timeout(REQUEST_TIMEOUT, stream.get_raw_message(sequence)).await;
        match response.context("NATS has not answered in time")? {
            // After a loss another message may have this number.
            Ok(message) => {
                let id = message.headers.get(NATS_MESSAGE_ID);
                Ok(id.is_some_and(|id| id.as_str() == ResultMessage::id_of(lease)))
            }
            Err(error) if error.kind() == RawMessageErrorKind::NoMessageFound => Ok(false),
            Err(error) => Err(error).with_context(|| format!("reading the stream {name}")),
        }
    }

    /// The stream with the wanted configuration, owned by this server.
    async fn stream(&self, wanted: stream::Config, known: &AtomicBool) -> anyhow::Result<Stream> {
        let name = &wanted.name;
        let doing = || format!("setting up the stream {name}");
        let mut stream = self.owned_stream(&wanted, known).await?;
        let found = &stream.cached_info().config;
        if !matches_stream(found, &wanted) {
            self.jetstream
                .update_stream(&wanted)
                .await
                .with_context(|| {
                    format!(
                        "the stream {name} has other settings than this server needs, and NATS cannot change them: delete it \
                         (`nats stream rm {name}`), and this server creates it again; the jobs of its messages are repeated"
                    )
                })?;
            let found = &stream.info().await.with_context(doing)?.config;
            anyhow::ensure!(
                matches_stream(found, &wanted),
                "NATS does not apply the requested settings of the stream {name}; a newer nats-server may do so"
            );
        }
        Ok(stream)
    }

    /// The stream, created if necessary; an error if another server owns it.
    async fn owned_stream(
        &self,
        wanted: &stream::Config,
        known: &AtomicBool,
    ) -> anyhow::Result<Stream> {
        let name = &wanted.name;
        let stream = self.jetstream.get_or_create_stream(wanted.clone()).await;
        let stream = stream.with_context(|| format!("setting up the stream {name}"))?;
        let owner = &stream.cached_info().config.description;
        let is_owned = *owner == wanted.description;
        known.store(is_owned, Ordering::Relaxed);
        anyhow::ensure!(
            is_owned,
            "the stream {name} is another server's ({}): give each server its own nats.name",
            owner.as_deref().unwrap_or("it has no description")
        );
        Ok(stream)
    }

    fn jobs_config(&self) -> stream::Config {
        stream::Config {
            name: self.names.jobs_stream(),
            subjects: vec![self.names.jobs()],
            description: Some(self.owner.clone()),
            retention: RetentionPolicy::WorkQueue,
            discard: DiscardPolicy::New,
            max_messages: MAX_JOBS,
            ..stream::Config::default()
        }
    }

    fn results_config(&self) -> stream::Config {
        stream::Config {
            name: self.names.results_stream(),
            subjects: vec![self.names.results(ALL)],
            description: Some(self.owner.clone()),
            retention: RetentionPolicy::WorkQueue,
            discard: DiscardPolicy::New,
            max_bytes: MAX_RESULT_BYTES,
            duplicate_window: DUPLICATE_WINDOW,
            ..stream::Config::default()
        }
    }
}

/// Has the consumer received more messages than its stream has ever had? Then NATS has lost messages, and new messages with
/// their numbers would not be delivered.
pub(super) const fn is_ahead(consumer: &consumer::Info, stream: &stream::State) -> bool {
    consumer.delivered.stream_sequence > stream.last_sequence
}

async fn consumer(stream: &Stream, wanted: pull::Config) -> anyhow::Result<PullConsumer> {
    let name = wanted.durable_name.as_deref().unwrap_or_default();
    let doing = || format!("setting up the consumer {name}");
    let consumer = stream.create_consumer(wanted.clone()).await;
    let mut consumer: PullConsumer = consumer.with_context(doing)?;
    let state = stream.get_info().await.with_context(doing)?.state;
    let known = consumer.cached_info();
    let is_idle = known.num_pending == 0 && known.num_ack_pending == 0;
    if is_ahead(known, &state) || (is_idle && state.messages > 0) {
        tracing::warn!(consumer = name, "{MESSAGES_LOST}");
        stream.delete_consumer(name).await.with_context(doing)?;
        let recreated = stream.create_consumer(wanted.clone()).await;
        consumer = recreated.with_context(doing)?;
    }
    let found = &consumer.cached_info().config;
    anyhow::ensure!(
        matches_consumer(found, &wanted),
        "NATS does not apply the requested settings of the consumer {name}; a newer nats-server may do so"
    );
    Ok(consumer)
}

fn matches_stream(found: &stream::Config, wanted: &stream::Config) -> bool {
    found.subjects == wanted.subjects
        && found.retention == wanted.retention
        && found.discard == wanted.discard
        && found.storage == wanted.storage
        && (wanted.max_messages == 0 || found.max_messages == wanted.max_messages)
        && (wanted.max_bytes == 0 || found.max_bytes == wanted.max_bytes)
        && (wanted.duplicate_window.is_zero() || found.duplicate_window == wanted.duplicate_window)
}

/// Settings that were not requested may have any value.
fn matches_consumer(found: &jetstream::consumer::Config, wanted: &pull::Config) -> bool {
    found.max_deliver == wanted.max_deliver
        && found.ack_policy == wanted.ack_policy
        && (wanted.ack_wait.is_zero() || found.ack_wait == wanted.ack_wait)
        && (wanted.max_ack_pending == 0 || found.max_ack_pending == wanted.max_ack_pending)
        && (wanted.max_waiting == 0 || found.max_waiting == wanted.max_waiting)
}

/// Each job is delivered once. The server notices jobs that no worker starts.
fn jobs_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(JOBS_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        max_deliver: 1,
        max_ack_pending: MAX_JOBS,
        max_waiting: MAX_WAITING,
        ..pull::Config::default()
    }
}

fn results_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(RESULTS_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        ack_wait: ACK_WAIT,
        max_deliver: -1,
        ..pull::Config::default()
    }
}
