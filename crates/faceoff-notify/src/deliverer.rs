//! Delivery to webhooks, the Internet addresses to which the server sends events. The deliverer first *plans*: it stores a
//! delivery for each event of the log and each webhook that gets it. Then it sends the deliveries that are due.

use crate::{
    address::WebhookRules,
    boxed_future,
    feed::Feed,
    notice::{Audience, Notice},
    notice_filter::NoticeFilter,
    sender::Sender,
};
use faceoff_store::{Change, Delivery, PlannedDeliveries, Store, StoreError, Subject, Webhook};
use faceoff_types::{Clock, TeamId, WebhookId};
use serde_json::{Value, json};
use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
    time::Duration,
};
use tokio::{
    sync::broadcast::{self, error::RecvError},
    task::{self, JoinSet},
    time::{Instant, sleep, sleep_until},
};
use tokio_util::sync::CancellationToken;

/// Maximum number of concurrent messages; each webhook has at most one.
const MAX_CONCURRENT: usize = 32;
/// Maximum number of concurrent messages of one owner, so that slow receivers do not delay other owners' messages.
const MAX_CONCURRENT_PER_OWNER: usize = 3;
/// Minimum time between two reads of the log, so that several events are planned together.
const MIN_READ_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum time between two reads of the log. Signals of new events do not suffice: another process may write to the
/// log, and a machine may sleep.
const MAX_READ_INTERVAL: Duration = Duration::from_secs(5);

/// Pause after an attempt that could not be recorded. The message is sent again, but a full disk must not cause a tight loop.
const UNRECORDED_PAUSE: Duration = Duration::from_secs(60);

/// Body of a message, by the Standard Webhooks conventions: event kind, time and data.
#[must_use]
pub fn message(kind: &str, occurred_at: jiff::Timestamp, data: &Value) -> String {
    json!({ "type": kind, "timestamp": occurred_at, "data": data }).to_string()
}

/// Sends messages to webhooks. Its state is in the store: after a crash it sends unrecorded attempts again, with the
/// same id.
#[derive(Debug, Clone)]
pub struct Deliverer {
    store: Store,
    clock: Clock,
    sender: Sender,
    feed: Arc<Feed>,
}

/// Deliveries that are being sent.
#[derive(Debug, Default)]
struct ActiveDeliveries {
    tasks: JoinSet<()>,
    /// For each task, its webhook and the team that owns this; `None` for the organisers.
    webhooks: HashMap<task::Id, (WebhookId, Option<TeamId>)>,
}

impl ActiveDeliveries {
    /// Do the limits allow another delivery to this webhook?
    fn can_start(&self, webhook: &Webhook) -> bool {
        let deliveries_of_owner = self
            .webhooks
            .values()
            .filter(|(_, team)| *team == webhook.team);
        self.webhooks.len() < MAX_CONCURRENT
            && deliveries_of_owner.count() < MAX_CONCURRENT_PER_OWNER
            && self.webhooks.values().all(|(id, _)| *id != webhook.id)
    }

    /// Waits for the end of one delivery; false if there is none.
    async fn join_next(&mut self) -> bool {
        let Some(ended) = self.tasks.join_next_with_id().await else {
            return false;
        };
        let id = match ended {
            Ok((id, ())) => id,
            Err(error) => {
                tracing::error!(%error, "sending a message to a webhook failed; it is sent again");
                error.id()
            }
        };
        self.webhooks.remove(&id);
        true
    }
}

impl Deliverer {
    /// A deliverer with these rules, and with `tls` for https.
    ///
    /// # Errors
    /// If the HTTP client cannot be built.
    pub fn new(
        store: Store,
        clock: Clock,
        rules: WebhookRules,
        tls: rustls::ClientConfig,
    ) -> Result<Self, reqwest::Error> {
        Ok(Self {
            feed: Arc::new(Feed::new(store.clone())),
            sender: Sender::new(rules, tls)?,
            store,
            clock,
        })
    }

    /// Delivers until `shutdown`. Database errors are retried.
    #[boxed_future]
    pub async fn run(self, shutdown: CancellationToken) {
        let mut active = ActiveDeliveries::default();
        let mut changes = self.store.events();
        let mut has_failed = false;
        loop {
            let planned_at = Instant::now();
            let wait = match self.plan_and_start(&mut active).await {
                Ok(wait) => {
                    has_failed = false;
                    wait
                }
                Err(error) => {
                    // Logged once: the error repeats every few seconds.
                    if !has_failed {
                        tracing::error!(%error, "webhooks could not be processed; trying again");
                    }
                    has_failed = true;
                    MAX_READ_INTERVAL
                }
            };
            let wake_at = planned_at + wait.min(MAX_READ_INTERVAL);
            tokio::select! {
                // Active deliveries are sent again after the next start.
                () = shutdown.cancelled() => return,
                () = sleep_until(wake_at) => {}
                true = active.join_next() => {}
                () = wait_for_change(&mut changes) => {
                    tokio::select! {
                        () = shutdown.cancelled() => return,
                        () = sleep_until(planned_at + MIN_READ_INTERVAL) => {}
                    }
                }
            }
            // Drops the queued signals, since the next step reads all new events.
            changes = changes.resubscribe();
        }
    }

    /// Plans and sends due deliveries until there are none; [`run`](Self::run) does this continuously.
    ///
    /// # Errors
    /// If the database fails.
    #[boxed_future]
    pub async fn deliver_due(&self) -> Result<(), StoreError> {
        let mut active = ActiveDeliveries::default();
        loop {
            self.plan_and_start(&mut active).await?;
            let has_ended = active.join_next().await;
            if !has_ended && self.store.webhooks_with_new_events().await?.is_empty() {
                return Ok(());
            }
        }
    }

    /// Plans deliveries of the next page of the log, and starts due deliveries within the limits. Returns the time until
    /// the next step.
    async fn plan_and_start(&self, active: &mut ActiveDeliveries) -> Result<Duration, StoreError> {
        let has_more = self.plan().await?;
        let now = self.clock.now();
        for delivery in self.store.due_deliveries(now).await? {
            let webhook = match self.store.webhook(delivery.webhook).await {
                // Removed since then.
                Err(StoreError::NotFound(_)) => continue,
                webhook => webhook?,
            };
            if !active.can_start(&webhook) {
                continue;
            }
            let webhook_and_owner = (webhook.id, webhook.team);
            let (deliverer, url) = (self.clone(), webhook.url);
            let task = active.tasks.spawn(async move {
                deliverer.send(&url, delivery).await;
            });
            active.webhooks.insert(task.id(), webhook_and_owner);
        }
        if has_more {
            return Ok(Duration::ZERO);
        }
        let next = self.store.next_delivery_at().await?;
        // Due deliveries beyond the limits start when an active one ends.
        let wait = next
            .filter(|due| *due > now)
            .map_or(MAX_READ_INTERVAL, |due| {
                Duration::try_from(due.duration_since(now)).unwrap_or(MAX_READ_INTERVAL)
            });
        Ok(wait)
    }

    /// Plans deliveries of the next page of the log, for all webhooks that have not seen it. True if there may be more.
    async fn plan(&self) -> Result<bool, StoreError> {
        // Webhooks by the id of the last event that they have seen: those at the same position get the same page.
        let mut by_position: BTreeMap<i64, Vec<Webhook>> = BTreeMap::new();
        for webhook in self.store.webhooks_with_new_events().await? {
            by_position.entry(webhook.seen).or_default().push(webhook);
        }
        let mut planned = Vec::new();
        for (position, webhooks) in by_position {
            let Some(page) = self.feed.page_after(position).await? else {
                continue;
            };
            for webhook in webhooks {
                let filter = NoticeFilter::parse(&webhook.topics);
                let audience = webhook.team.map_or(Audience::Organiser, Audience::Team);
                let is_wanted = |notice: &&Notice| {
                    filter.as_ref().is_ok_and(|filter| filter.matches(notice))
                        && notice.is_visible_to(audience, &page.stage_visibility)
                };
                let bodies = page.notices.iter().filter(is_wanted).map(|notice| {
                    let body = message(&notice.kind, notice.at, &notice.json());
                    (notice.id, notice.kind.clone(), body)
                });
                planned.push(PlannedDeliveries {
                    webhook: webhook.id,
                    seen_event: position,
                    last_event: page.last_event,
                    bodies: bodies.collect(),
                });
            }
        }
        // If there was a page, another one may follow.
        let has_more = !planned.is_empty();
        if has_more {
            self.store
                .plan_deliveries(planned, self.clock.now())
                .await?;
        }
        Ok(has_more)
    }

    /// Sends a message and records the attempt.
    async fn send(&self, url: &str, delivery: Delivery) {
        let now = self.clock.now();
        let recorded = async {
            let secrets = self.store.webhook_secrets(delivery.webhook, now).await?;
            let (attempt, outcome) = self.sender.send(url, &secrets, &delivery, now).await;
            self.store
                .record_attempt(delivery.id, attempt, outcome)
                .await
        };
        match recorded.await {
            Ok(()) | Err(StoreError::NotFound(_)) => {}
            Err(error) => {
                tracing::error!(delivery = %delivery.id, %error, "an attempt to send to a webhook was not recorded; it is sent again");
                sleep(UNRECORDED_PAUSE).await;
            }
        }
    }
}

/// Waits for a new event in the log, or a test message.
async fn wait_for_change(changes: &mut broadcast::Receiver<Change>) {
    loop {
        match changes.recv().await {
            // The store signals a new test message, which is not an event, in this way.
            Ok(Change::Progress(Subject::Season)) => return,
            Ok(Change::Progress(_)) => {}
            Ok(Change::Recorded(_)) | Err(RecvError::Lagged(_)) => return,
            Err(RecvError::Closed) => std::future::pending().await,
        }
    }
}
