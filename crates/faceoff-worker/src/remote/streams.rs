//! The streams and consumers of one server, as they are to be: NATS leaves out silently what an old version does not know, so what comes
//! back is compared.

use super::{
    connection::ANSWER,
    names::{ALL, Names, ORDERS_CONSUMER, OUTCOMES_CONSUMER},
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
use faceoff_wire::{remote::RemoteOutcome, work::Lease};
use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

/// Orders in the stream at most; there are never more than free slots.
const MOST_ORDERS: i64 = 100_000;
/// Bytes of outcomes that wait for the server at most.
const MOST_OUTCOME_BYTES: i64 = 1 << 30;
/// An outcome that is sent twice within this is stored once by NATS; by the server, always.
const SENT_TWICE_WITHIN: Duration = Duration::from_secs(120);
/// An outcome that the server has taken and not said to have stored comes again after this.
const TAKEN_FOR: Duration = Duration::from_secs(60);
/// Said of a stream that has less than its consumer believes. What is there yet is then delivered once more, which changes nothing.
pub(super) const LOST_A_PART: &str =
    "NATS has lost a part of what it had stored: its consumer is made anew";
/// Slots that may ask at the same time.
const MOST_WAITING: i64 = 8192;

/// Where streams are, and whose they are to be.
pub(super) struct Streams {
    pub(super) jetstream: jetstream::Context,
    pub(super) names: Names,
    /// In words, as their description.
    pub(super) owner: String,
    /// They are known to be this server's, of orders and of outcomes. Until then, and while another's are there, it answers nobody: who asks
    /// is another's worker.
    are_ours: [AtomicBool; 2],
}

impl Streams {
    pub(super) const fn of(jetstream: jetstream::Context, names: Names, owner: String) -> Self {
        Self {
            jetstream,
            names,
            owner,
            are_ours: [const { AtomicBool::new(false) }; 2],
        }
    }

    pub(super) fn are_ours(&self) -> bool {
        let is_ours = |known: &AtomicBool| known.load(Ordering::Relaxed);
        self.are_ours.iter().all(is_ours)
    }

    pub(super) async fn orders(&self) -> anyhow::Result<(Stream, PullConsumer)> {
        let stream = self.stream(self.orders_config(), &self.are_ours[0]).await?;
        let consumer = consumer(&stream, orders_consumer()).await?;
        Ok((stream, consumer))
    }

    pub(super) async fn outcomes(&self) -> anyhow::Result<PullConsumer> {
        // Whose the first is the second is, too: of two servers that find none, each would otherwise make one.
        self.own(&self.orders_config(), &self.are_ours[0]).await?;
        let stream = self.stream(self.outcomes_config(), &self.are_ours[1]);
        consumer(&stream.await?, outcomes_consumer()).await
    }

    /// Looks whether outcomes that nobody gets are there, or the stream is not, of which nobody else would tell. `held_back`: where such
    /// outcomes began at the last look.
    ///
    /// # Errors
    /// If it is to be set up anew.
    pub(super) async fn check_outcomes(
        &self,
        consumer: &mut PullConsumer,
        held_back: &mut Option<u64>,
    ) -> anyhow::Result<()> {
        let name = self.names.outcomes_stream();
        let doing = || format!("looking at the stream {name}");
        let stream = self.jetstream.get_stream(&name).await;
        let stream = stream.with_context(doing)?;
        let state = &stream.cached_info().state;
        let known = consumer.info().await.with_context(doing)?;
        let nobody_gets = known.num_pending == 0 && known.num_ack_pending == 0;
        let first = (nobody_gets && state.messages > 0).then_some(state.first_sequence);
        // What has just been acknowledged looks so, too, but not twice.
        anyhow::ensure!(first.is_none() || first != *held_back, LOST_A_PART);
        *held_back = first;
        Ok(())
    }

    /// Is what came of work under this lease at its place? NATS may say that it has stored something before its disk has, and lose it.
    pub(super) async fn has_outcome(&self, lease: &Lease, sequence: u64) -> anyhow::Result<bool> {
        let name = self.names.outcomes_stream();
        let stream = self.jetstream.get_stream_no_info(&name).await?;
        // While NATS is away, too, the answer is not waited for.
        let asked = tokio::time::timeout(ANSWER, stream.get_raw_message(sequence)).await;
        match asked.context("NATS has not answered in time")? {
            // After a loss the place may be another's.
            Ok(message) => {
                let id = message.headers.get(NATS_MESSAGE_ID);
                Ok(id.is_some_and(|id| id.as_str() == RemoteOutcome::id_of(lease)))
            }
            Err(error) if error.kind() == RawMessageErrorKind::NoMessageFound => Ok(false),
            Err(error) => Err(error).with_context(|| format!("looking into the stream {name}")),
        }
    }

    /// A stream that is as it is to be, and ours.
    async fn stream(&self, wanted: stream::Config, known: &AtomicBool) -> anyhow::Result<Stream> {
        let name = &wanted.name;
        let doing = || format!("setting up the stream {name}");
        let mut stream = self.own(&wanted, known).await?;
        let found = &stream.cached_info().config;
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

    /// A stream that is ours.
    async fn own(&self, wanted: &stream::Config, known: &AtomicBool) -> anyhow::Result<Stream> {
        let name = &wanted.name;
        let stream = self.jetstream.get_or_create_stream(wanted.clone()).await;
        let stream = stream.with_context(|| format!("setting up the stream {name}"))?;
        let whose = &stream.cached_info().config.description;
        let is_ours = *whose == wanted.description;
        known.store(is_ours, Ordering::Relaxed);
        anyhow::ensure!(
            is_ours,
            "the stream {name} is another server's ({}): give each its own nats.name",
            whose.as_deref().unwrap_or("it does not say whose")
        );
        Ok(stream)
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

/// Has a consumer been given more than its stream has ever had? Then NATS has lost a part of the stream, and what comes in its place would
/// reach nobody.
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
    let nobody_gets = known.num_pending == 0 && known.num_ack_pending == 0;
    if is_ahead(known, &state) || (nobody_gets && state.messages > 0) {
        tracing::warn!(consumer = name, "{LOST_A_PART}");
        stream.delete_consumer(name).await.with_context(doing)?;
        let again = stream.create_consumer(wanted.clone()).await;
        consumer = again.with_context(doing)?;
    }
    let found = &consumer.cached_info().config;
    anyhow::ensure!(
        is_kept(found, &wanted),
        "NATS keeps the consumer {name} otherwise than it was asked to; a newer nats-server may not"
    );
    Ok(consumer)
}

fn is_like(found: &stream::Config, wanted: &stream::Config) -> bool {
    found.subjects == wanted.subjects
        && found.retention == wanted.retention
        && found.discard == wanted.discard
        && found.storage == wanted.storage
        && (wanted.max_messages == 0 || found.max_messages == wanted.max_messages)
        && (wanted.max_bytes == 0 || found.max_bytes == wanted.max_bytes)
        && (wanted.duplicate_window.is_zero() || found.duplicate_window == wanted.duplicate_window)
}

/// What is not asked for is NATS's to choose.
fn is_kept(found: &jetstream::consumer::Config, wanted: &pull::Config) -> bool {
    found.max_deliver == wanted.max_deliver
        && found.ack_policy == wanted.ack_policy
        && (wanted.ack_wait.is_zero() || found.ack_wait == wanted.ack_wait)
        && (wanted.max_ack_pending == 0 || found.max_ack_pending == wanted.max_ack_pending)
        && (wanted.max_waiting == 0 || found.max_waiting == wanted.max_waiting)
}

/// Each order is delivered once: that nobody has begun it, the server notices by itself.
fn orders_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(ORDERS_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        max_deliver: 1,
        max_ack_pending: MOST_ORDERS,
        max_waiting: MOST_WAITING,
        ..pull::Config::default()
    }
}

fn outcomes_consumer() -> pull::Config {
    pull::Config {
        durable_name: Some(OUTCOMES_CONSUMER.to_owned()),
        ack_policy: AckPolicy::Explicit,
        ack_wait: TAKEN_FOR,
        max_deliver: -1,
        ..pull::Config::default()
    }
}
