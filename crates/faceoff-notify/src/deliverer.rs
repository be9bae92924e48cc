//! Tells webhooks what happens: makes deliveries of the log and sends what is due.

use crate::{
    about::About,
    address::WebhookRules,
    boxed,
    feed::Feed,
    notice::{Notice, Reader},
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

/// Messages under way at a time, one of each webhook …
const AT_ONCE: usize = 32;
/// … and so many of an owner: receivers that never answer hold up nobody else's.
const OF_AN_OWNER: usize = 3;
/// Between two looks at the log: what happens in between is planned together.
const PACE: Duration = Duration::from_secs(1);
/// The longest that nothing is looked at: another process may write, and a machine may sleep.
const LOOK: Duration = Duration::from_secs(5);

/// What could not be noted is sent again, but not at once: a disk that is full must not make us send without a pause.
const UNNOTED: Duration = Duration::from_secs(60);

/// What a webhook is sent, by the conventions: what happened, when, and what it is about.
#[must_use]
pub fn message(kind: &str, at: jiff::Timestamp, data: &Value) -> String {
    json!({ "type": kind, "timestamp": at, "data": data }).to_string()
}

/// Whoever tells webhooks. All that it knows is in the store: one that is killed sends what it had not noted again, by the
/// same id.
#[derive(Debug, Clone)]
pub struct Deliverer {
    store: Store,
    clock: Clock,
    sender: Sender,
    feed: Arc<Feed>,
}

/// What is being sent.
#[derive(Debug, Default)]
struct UnderWay {
    sending: JoinSet<()>,
    of: HashMap<task::Id, (WebhookId, Option<TeamId>)>,
}

impl UnderWay {
    fn has_room_for(&self, webhook: &Webhook) -> bool {
        let of_owner = self.of.values().filter(|(_, team)| *team == webhook.team);
        self.of.len() < AT_ONCE
            && of_owner.count() < OF_AN_OWNER
            && self.of.values().all(|(id, _)| *id != webhook.id)
    }

    /// Waits for the end of one; false: none is under way.
    async fn one_ended(&mut self) -> bool {
        let Some(ended) = self.sending.join_next_with_id().await else {
            return false;
        };
        let id = match ended {
            Ok((id, ())) => id,
            Err(error) => {
                tracing::error!(%error, "a message to a webhook was not sent; it is sent again");
                error.id()
            }
        };
        self.of.remove(&id);
        true
    }
}

impl Deliverer {
    /// One that sends by these rules, and by `tls` to https.
    ///
    /// # Errors
    /// If no client can be made of that.
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

    /// Tells until `shutdown`. What fails of the database is tried again.
    #[boxed]
    pub async fn run(self, shutdown: CancellationToken) {
        let mut under_way = UnderWay::default();
        let mut changes = self.store.events();
        let mut has_failed = false;
        loop {
            let planned_at = Instant::now();
            let next = match self.step(&mut under_way).await {
                Ok(next) => {
                    has_failed = false;
                    next
                }
                Err(error) => {
                    // Once: it comes again every few seconds.
                    if !has_failed {
                        tracing::error!(%error, "webhooks could not be told; trying again");
                    }
                    has_failed = true;
                    LOOK
                }
            };
            let wake = planned_at + next.min(LOOK);
            tokio::select! {
                // What is under way is sent again after the next start.
                () = shutdown.cancelled() => return,
                () = sleep_until(wake) => {}
                true = under_way.one_ended() => {}
                () = changed(&mut changes) => {
                    tokio::select! {
                        () = shutdown.cancelled() => return,
                        () = sleep_until(planned_at + PACE) => {}
                    }
                }
            }
            changes = changes.resubscribe();
        }
    }

    /// Plans and sends what is due, and again until nothing is; [`run`](Self::run) does so at the right times.
    ///
    /// # Errors
    /// If the database fails.
    #[boxed]
    pub async fn deliver_due(&self) -> Result<(), StoreError> {
        let mut under_way = UnderWay::default();
        loop {
            self.step(&mut under_way).await?;
            let more = under_way.one_ended().await;
            if !more && self.store.webhooks_behind().await?.is_empty() {
                return Ok(());
            }
        }
    }

    /// Plans a page of the log, and begins to send what is due and has room. How long until there is something to do.
    async fn step(&self, under_way: &mut UnderWay) -> Result<Duration, StoreError> {
        let has_more = self.plan().await?;
        let now = self.clock.now();
        for delivery in self.store.due_deliveries(now).await? {
            let webhook = match self.store.webhook(delivery.webhook).await {
                Err(StoreError::NotFound(_)) => continue,
                webhook => webhook?,
            };
            if !under_way.has_room_for(&webhook) {
                continue;
            }
            let of = (webhook.id, webhook.team);
            let (deliverer, url) = (self.clone(), webhook.url);
            let started = under_way.sending.spawn(async move {
                deliverer.send(&url, delivery).await;
            });
            under_way.of.insert(started.id(), of);
        }
        if has_more {
            return Ok(Duration::ZERO);
        }
        let next = self.store.next_delivery().await?;
        // What is due and not under way waits for the end of something that is.
        let wait = next.filter(|at| *at > now).map_or(LOOK, |at| {
            Duration::try_from(at.duration_since(now)).unwrap_or(LOOK)
        });
        Ok(wait)
    }

    /// Makes deliveries of the next page of the log, for all webhooks that have not seen it. Is there more?
    async fn plan(&self) -> Result<bool, StoreError> {
        let mut at_the_same_place: BTreeMap<i64, Vec<Webhook>> = BTreeMap::new();
        for webhook in self.store.webhooks_behind().await? {
            at_the_same_place
                .entry(webhook.seen)
                .or_default()
                .push(webhook);
        }
        let mut planned = Vec::new();
        for (after, webhooks) in at_the_same_place {
            let Some(page) = self.feed.after(after).await? else {
                continue;
            };
            for webhook in webhooks {
                let about = About::of(&webhook.about);
                let reader = webhook.team.map_or(Reader::Organiser, Reader::Team);
                let is_told = |notice: &&Notice| {
                    about.as_ref().is_ok_and(|about| about.takes(notice))
                        && notice.is_told_to(reader, &page.stages)
                };
                let told = page.notices.iter().filter(is_told).map(|notice| {
                    let body = message(&notice.kind, notice.at, &notice.json());
                    (notice.id, notice.kind.clone(), body)
                });
                planned.push(PlannedDeliveries {
                    webhook: webhook.id,
                    after,
                    until: page.until,
                    bodies: told.collect(),
                });
            }
        }
        let has_more = !planned.is_empty();
        if has_more {
            self.store
                .plan_deliveries(planned, self.clock.now())
                .await?;
        }
        Ok(has_more)
    }

    /// Sends something and notes what came of it.
    async fn send(&self, url: &str, delivery: Delivery) {
        let now = self.clock.now();
        let noted = async {
            let keys = self.store.webhook_keys(delivery.webhook, now).await?;
            let (attempt, means) = self.sender.send(url, &keys, &delivery, now).await;
            self.store.note_attempt(delivery.id, attempt, means).await
        };
        match noted.await {
            Ok(()) | Err(StoreError::NotFound(_)) => {}
            Err(error) => {
                tracing::error!(delivery = %delivery.id, %error, "what came of a message to a webhook is not noted; it is sent again");
                sleep(UNNOTED).await;
            }
        }
    }
}

/// Until something is in the log that was not.
async fn changed(changes: &mut broadcast::Receiver<Change>) {
    loop {
        match changes.recv().await {
            // A test is to be sent.
            Ok(Change::Progress(Subject::Season)) => return,
            Ok(Change::Progress(_)) => {}
            Ok(Change::Recorded(_)) | Err(RecvError::Lagged(_)) => return,
            Err(RecvError::Closed) => std::future::pending().await,
        }
    }
}
