//! The streams of a server in NATS (stored messages: one of jobs, one of results), and the consumers by which they are read.
//! Old versions of NATS silently ignore unknown settings, so the actual settings are compared with the requested ones.

use super::{
    connection::REQUEST_TIMEOUT,
    names::{ALL, JOBS_CONSUMER, Names, RESULTS_CONSUMER},
};
use anyhow::Context as _;
use async_nats::{
    header::NATS_MESSAGE_ID,
    jetstream::{
        self, ErrorCode,
        consumer::{self, AckPolicy, PullConsumer, pull},
        context::{CreateStreamError, CreateStreamErrorKind},
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
/// Maximum size of all pending results, in bytes. NATS reserves it on its disk when the stream is created.
const MAX_RESULT_BYTES: i64 = 256 << 20;
/// Time within which NATS drops repeated results. The server commits a result once in any case.
const DUPLICATE_WINDOW: Duration = Duration::from_secs(120);
/// Time after which a result that the server has not acknowledged is delivered again.
const ACK_WAIT: Duration = Duration::from_secs(60);
/// The error for a stream that has fewer messages than its consumer assumes. With a new consumer the remaining messages are
/// delivered again, which has no effect.
pub(super) const MESSAGES_LOST: &str =
    "NATS has lost stored messages: the consumer is created again";
/// Maximum number of slots that wait for a job at a time, over all workers.
const MAX_WAITING: i64 = 8192;

/// The streams of a server.
pub(super) struct Streams {
    pub(super) jetstream: jetstream::Context,
    pub(super) names: Names,
    /// Identifies the server; stored as the description of the streams.
    pub(super) owner: String,
    /// Is the stream of jobs known to belong to this server? Unless both streams do, workers are not answered, since they
    /// belong to another server.
    owns_jobs_stream: AtomicBool,
    /// Is the stream of results known to belong to this server?
    owns_results_stream: AtomicBool,
}

impl Streams {
    pub(super) const fn new(jetstream: jetstream::Context, names: Names, owner: String) -> Self {
        Self {
            jetstream,
            names,
            owner,
            owns_jobs_stream: AtomicBool::new(false),
            owns_results_stream: AtomicBool::new(false),
        }
    }

    pub(super) fn are_owned(&self) -> bool {
        self.owns_jobs_stream.load(Ordering::Relaxed)
            && self.owns_results_stream.load(Ordering::Relaxed)
    }

    /// Sets up the stream of jobs and its consumer.
    pub(super) async fn jobs(&self) -> anyhow::Result<(Stream, PullConsumer)> {
        let stream = self
            .stream(self.jobs_config(), &self.owns_jobs_stream)
            .await?;
        let consumer = consumer(&stream, jobs_consumer()).await?;
        Ok((stream, consumer))
    }

    /// Sets up the stream of results and its consumer.
    pub(super) async fn results(&self) -> anyhow::Result<PullConsumer> {
        // The stream of jobs is created first and decides the owner of both. Otherwise two new servers could create one stream each.
        self.owned_stream(&self.jobs_config(), &self.owns_jobs_stream)
            .await?;
        let stream = self.stream(self.results_config(), &self.owns_results_stream);
        consumer(&stream.await?, results_consumer()).await
    }

    /// Checks that the stream of results exists and has no results that are never delivered; such failures cause no other
    /// error. `undelivered` is the sequence number of the first apparently undelivered result of the previous check.
    ///
    /// # Errors
    /// If the stream and its consumer must be set up again.
    pub(super) async fn check_results(
        &self,
        consumer: &mut PullConsumer,
        undelivered: &mut Option<u64>,
    ) -> anyhow::Result<()> {
        let name = self.names.results_stream();
        let context = || format!("checking the stream {name}");
        let stream = self.jetstream.get_stream(&name).await;
        let stream = stream.with_context(context)?;
        let state = &stream.cached_info().state;
        let info = consumer.info().await.with_context(context)?;
        let is_idle = info.num_pending == 0 && info.num_ack_pending == 0;
        let first = (is_idle && state.messages > 0).then_some(state.first_sequence);
        // If the consumer is idle, the stream must be empty. A result that was just acknowledged may still be in it, but not at the next
        // check.
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

    /// Sets up a stream with the requested configuration. `is_known_as_own` is set if this server owns the stream, otherwise
    /// cleared, with an error.
    async fn stream(
        &self,
        requested: stream::Config,
        is_known_as_own: &AtomicBool,
    ) -> anyhow::Result<Stream> {
        let name = &requested.name;
        let context = || format!("setting up the stream {name}");
        let mut stream = self.owned_stream(&requested, is_known_as_own).await?;
        let actual = &stream.cached_info().config;
        if !matches_stream(actual, &requested) {
            self.jetstream
                .update_stream(&requested)
                .await
                .with_context(|| {
                    format!(
                        "the stream {name} has other settings than this server needs, and NATS cannot change them: delete it \
                         (`nats stream rm {name}`), and this server creates it again; the jobs of its messages are repeated"
                    )
                })?;
            let actual = &stream.info().await.with_context(context)?.config;
            anyhow::ensure!(
                matches_stream(actual, &requested),
                "NATS does not apply the requested settings of the stream {name}; a newer nats-server may do so"
            );
        }
        Ok(stream)
    }

    /// Opens the stream, or creates it; fails if another server owns it.
    async fn owned_stream(
        &self,
        requested: &stream::Config,
        is_known_as_own: &AtomicBool,
    ) -> anyhow::Result<Stream> {
        let name = &requested.name;
        let stream = self.jetstream.get_or_create_stream(requested.clone()).await;
        let stream = stream.map_err(|error| stream_error(name, error))?;
        let owner = &stream.cached_info().config.description;
        let is_owned = *owner == requested.description;
        is_known_as_own.store(is_owned, Ordering::Relaxed);
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

/// The error for a stream that cannot be set up. If NATS has no space for it, says how much it needs.
fn stream_error(name: &str, error: CreateStreamError) -> anyhow::Error {
    let has_no_space = matches!(
        error.kind(),
        CreateStreamErrorKind::JetStream(reason)
            if reason.error_code() == ErrorCode::STORAGE_RESOURCES_EXCEEDED
    );
    let context = match has_no_space {
        true => format!(
            "NATS has no space for the stream {name}, which needs {} MiB: free disk space and restart NATS, or raise max_file_store \
             in its configuration (by default, three quarters of the disk space that was free when it started)",
            MAX_RESULT_BYTES >> 20
        ),
        false => format!("setting up the stream {name}"),
    };
    anyhow::Error::new(error).context(context)
}

/// Has the consumer received more messages than its stream has ever had (by their sequence numbers)? Then NATS has lost
/// messages, and new messages with their numbers would not be delivered.
pub(super) const fn is_ahead(consumer: &consumer::Info, stream: &stream::State) -> bool {
    consumer.delivered.stream_sequence > stream.last_sequence
}

/// Sets up a consumer of the stream. If messages were lost, the consumer is created again.
async fn consumer(stream: &Stream, requested: pull::Config) -> anyhow::Result<PullConsumer> {
    let name = requested.durable_name.as_deref().unwrap_or_default();
    let context = || format!("setting up the consumer {name}");
    let consumer = stream.create_consumer(requested.clone()).await;
    let mut consumer: PullConsumer = consumer.with_context(context)?;
    let state = stream.get_info().await.with_context(context)?.state;
    let info = consumer.cached_info();
    let is_idle = info.num_pending == 0 && info.num_ack_pending == 0;
    if is_ahead(info, &state) || (is_idle && state.messages > 0) {
        tracing::warn!(consumer = name, "{MESSAGES_LOST}");
        stream.delete_consumer(name).await.with_context(context)?;
        let recreated = stream.create_consumer(requested.clone()).await;
        consumer = recreated.with_context(context)?;
    }
    let actual = &consumer.cached_info().config;
    anyhow::ensure!(
        matches_consumer(actual, &requested),
        "NATS does not apply the requested settings of the consumer {name}; a newer nats-server may do so"
    );
    Ok(consumer)
}

/// Settings that were not requested may have any value.
fn matches_stream(actual: &stream::Config, requested: &stream::Config) -> bool {
    actual.subjects == requested.subjects
        && actual.retention == requested.retention
        && actual.discard == requested.discard
        && actual.storage == requested.storage
        && (requested.max_messages == 0 || actual.max_messages == requested.max_messages)
        && (requested.max_bytes == 0 || actual.max_bytes == requested.max_bytes)
        && (requested.duplicate_window.is_zero()
            || actual.duplicate_window == requested.duplicate_window)
}

/// Settings that were not requested may have any value.
fn matches_consumer(actual: &jetstream::consumer::Config, requested: &pull::Config) -> bool {
    actual.max_deliver == requested.max_deliver
        && actual.ack_policy == requested.ack_policy
        && (requested.ack_wait.is_zero() || actual.ack_wait == requested.ack_wait)
        && (requested.max_ack_pending == 0 || actual.max_ack_pending == requested.max_ack_pending)
        && (requested.max_waiting == 0 || actual.max_waiting == requested.max_waiting)
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
