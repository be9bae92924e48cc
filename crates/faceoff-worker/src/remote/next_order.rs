//! Orders as a slot on another machine gets them: it asks, is given one, and begins it or leaves it to others.

use super::{
    connection::ANSWER,
    far_server::FarServer,
    link::within,
    names::{self, ORDERS_CONSUMER},
};
use anyhow::Context as _;
use async_nats::jetstream::{Message, consumer::PullConsumer};
use faceoff_wire::remote::{Answer, Ask, Outcome, RemoteOrder};
use futures::StreamExt as _;
use std::{
    sync::PoisonError,
    time::{Duration, Instant},
};

/// How long a request for an order stays open; it may die silently, and is made anew. So short, it is its own heartbeat. NATS's are not
/// asked for: a `Batch` of async-nats (0.51) that has read one is not woken by what comes next, and the order is lost.
const OPEN_FOR: Duration = Duration::from_secs(5);
/// So long a worker goes on without asking whether it may.
const MAY_WORK_FOR: Duration = Duration::from_secs(5);
/// So often leave to begin an order is asked for. An answer may be lost; the slot that has begun is told so again.
const BEGINS: u32 = 3;

impl FarServer {
    /// May this worker work? The log is told when that changes. What was answered a moment ago holds: an order says by itself of which
    /// program it is, and whether it is this worker's the server says when it begins.
    pub(super) async fn may_work(&self) -> anyhow::Result<bool> {
        let asked_at = || {
            let at = self.link.may_work_at.lock();
            at.unwrap_or_else(PoisonError::into_inner)
        };
        if asked_at().is_some_and(|at| at.elapsed() < MAY_WORK_FOR) {
            return Ok(true);
        }
        let answer = self.link.ask(&Ask::MayWork(self.link.own.clone())).await?;
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
        let found: PullConsumer = within(found).await.context("asking for orders")?;
        *known() = Some(found.clone());
        Ok(found)
    }

    /// Waits for an order, and begins it.
    pub(super) async fn order(&self, slot: &str) -> anyhow::Result<Option<RemoteOrder>> {
        let link = &self.link;
        let consumer = self.consumer().await?;
        let orders = consumer.batch().max_messages(1).expires(OPEN_FOR);
        let mut orders = within(orders.messages())
            .await
            .context("asking for an order")?;
        let free = link.names.free(link.worker.as_str());
        within(link.client.publish(free, Default::default()))
            .await
            .context("asking for an order")?;
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
        let acknowledged = async { message.ack().await.map_err(|error| anyhow::anyhow!(error)) };
        within(acknowledged)
            .await
            .context("acknowledging an order")?;
        let Some(mut order) = self.read(&message) else {
            return Ok(None);
        };
        order.order.lease.slot = names::slot(&link.worker, slot);
        Ok(self.begins(&order, slot).await.then_some(order))
    }

    /// An order that this worker can begin. Any other nobody begins, so it is given out again; the next answer of the server says what is
    /// wrong.
    fn read(&self, message: &Message) -> Option<RemoteOrder> {
        let link = &self.link;
        let mut unread = link.unread.lock().unwrap_or_else(PoisonError::into_inner);
        match serde_json::from_slice::<RemoteOrder>(&message.payload) {
            Ok(order) => {
                unread.clear();
                if order.program == link.own.program {
                    return Some(order);
                }
            }
            Err(error) => {
                let cause = error.to_string();
                if *unread != cause {
                    tracing::warn!(
                        cause,
                        "an order cannot be read, and is left to others: is it another version's?"
                    );
                    *unread = cause;
                }
            }
        }
        link.must_ask();
        None
    }

    /// Is it this slot's from now on? If the server does not say, it may be all the same: then it goes back, and need not wait for the end of
    /// its lease.
    async fn begins(&self, order: &RemoteOrder, slot: &str) -> bool {
        let link = &self.link;
        let (lease, unit) = (&order.order.lease, order.order.lease.unit);
        let begin = Ask::Begin {
            lease: lease.clone(),
            slot: slot.to_owned(),
        };
        let mut cause = String::new();
        for again in 0..BEGINS {
            if again > 0 {
                self.rest().await;
                if link.shutdown.is_cancelled() {
                    break;
                }
            }
            cause = match link.ask(&begin).await {
                Ok(Answer::Yes) => return true,
                Ok(Answer::No { .. }) => return false,
                Ok(Answer::Unknown) => "the server cannot tell now".to_owned(),
                Err(error) => format!("{error:#}"),
            };
        }
        tracing::warn!(%unit, cause, "the server does not say whether an order is this slot's: it is given back");
        let sent = self.send(lease, &order.grant, Outcome::Shutdown);
        let sent = tokio::time::timeout(ANSWER, sent).await;
        if let Err(error) = sent.map_err(anyhow::Error::from).flatten() {
            tracing::warn!(%unit, cause = format!("{error:#}"), "the unit could not be given back; its lease will end");
        }
        false
    }
}
