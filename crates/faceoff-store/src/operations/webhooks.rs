//! Webhooks: addresses to which messages about events are sent. Each message is a delivery, with one or more attempts.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        cleanup::earlier,
        requester::{self, Requester},
    },
    store::Store,
    tables::{
        deliveries::{self, Delivery, DeliveryAttempt, DeliveryState},
        events,
        webhooks::{self, DisabledWebhook, Webhook, WebhookSecrets},
    },
    write::Tx,
};
use faceoff_types::{DeliveryId, TeamId, WebhookId};
use jiff::{SignedDuration, Timestamp};

/// Number of webhooks that a team may have.
pub const MAX_TEAM_WEBHOOKS: i64 = 5;
/// Number of webhooks that the organisers may have.
pub const MAX_ORGANISER_WEBHOOKS: i64 = 20;
/// Approximate limit of a webhook's pending deliveries. Later events are turned into deliveries once it falls below.
pub const MAX_PENDING_DELIVERIES: u32 = 100;
/// Time for which messages are also signed with a replaced secret.
pub const OLD_SECRET_VALID_FOR: SignedDuration = SignedDuration::from_hours(24);
/// Time of continuous failure after which a webhook is disabled.
pub const DISABLED_AFTER: SignedDuration = SignedDuration::from_hours(3 * 24);
/// Time for which ended deliveries are kept.
pub const DELIVERIES_KEPT_FOR: SignedDuration = SignedDuration::from_hours(14 * 24);

/// A webhook to be created.
#[derive(Debug, Clone)]
pub struct NewWebhook {
    /// `None`: it belongs to the organisers.
    pub team: Option<TeamId>,
    pub name: String,
    /// Address of the receiver; the caller has checked that it is allowed.
    pub url: String,
    /// Topics, subjects and event kinds that are sent; empty: all.
    pub topics: Vec<String>,
    /// Key that signs the messages.
    pub secret: [u8; 32],
    pub requester: Requester,
}

/// Changes of a webhook; `None` leaves a value unchanged.
#[derive(Debug, Clone, Default)]
pub struct WebhookChange {
    pub name: Option<String>,
    pub url: Option<String>,
    pub topics: Option<Vec<String>>,
    /// Enables a disabled webhook again, for events from now on.
    pub enable: bool,
    /// It becomes the webhook's creator if the address changes or the webhook is enabled again.
    pub requester: Requester,
}

/// Deliveries of one webhook for a range of events.
#[derive(Debug, Clone)]
pub struct PlannedDeliveries {
    pub webhook: WebhookId,
    /// Id of the last event that the webhook had seen when the deliveries were planned: the one before the range.
    pub seen_event: i64,
    /// Id of the last event of the range.
    pub last_event: i64,
    /// Event id, event kind and message body of each delivery.
    pub bodies: Vec<(i64, String, String)>,
}

/// Outcome of a delivery attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeliveryOutcome {
    Accepted,
    /// Time of the next attempt; `None`: the delivery is given up.
    Failed {
        retry_at: Option<Timestamp>,
    },
    /// The receiver does not want any more messages (410).
    Gone,
}

const fn subject(webhook: &Webhook) -> Subject {
    match webhook.team {
        Some(team) => Subject::Team(team),
        None => Subject::Season,
    }
}

/// A delivery that is due at once.
fn new_delivery(
    webhook: WebhookId,
    event: Option<i64>,
    kind: String,
    body: String,
    now: Timestamp,
) -> Delivery {
    Delivery {
        id: DeliveryId::new(),
        webhook,
        event,
        kind,
        body,
        created_at: now,
        attempts: 0,
        last_attempt: None,
        state: DeliveryState::Pending { next_at: now },
    }
}

/// Disables a webhook and gives up its pending deliveries.
pub(crate) async fn disable(tx: &mut Tx, mut webhook: Webhook, reason: String) -> Result<()> {
    let now = tx.now;
    deliveries::give_up(tx, webhook.id, now).await?;
    webhook.disabled = Some(DisabledWebhook {
        at: now,
        reason: reason.clone(),
    });
    webhooks::update(tx, &webhook).await?;
    let event = Event::WebhookDisabled {
        webhook: webhook.id,
        reason,
    };
    tx.record(subject(&webhook), event);
    Ok(())
}

impl Store {
    /// All webhooks, the oldest first.
    #[boxed_future]
    pub async fn webhooks(&self) -> Result<Vec<Webhook>> {
        webhooks::all(&mut *self.database.read.acquire().await?).await
    }

    #[boxed_future]
    pub async fn webhook(&self, id: WebhookId) -> Result<Webhook> {
        webhooks::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// Secrets that sign a webhook's messages at `now`.
    #[boxed_future]
    pub async fn webhook_secrets(&self, id: WebhookId, now: Timestamp) -> Result<WebhookSecrets> {
        webhooks::secrets(&mut *self.database.read.acquire().await?, id, now).await
    }

    /// Creates a webhook for events from now on. [`StoreError::Conflict`] if its owner has as many as allowed.
    #[boxed_future]
    pub async fn create_webhook(
        &self,
        actor: Actor,
        new: NewWebhook,
        now: Timestamp,
    ) -> Result<Webhook> {
        self.write(actor, now, async |tx| {
            let creator = requester::check(tx, &new.requester, now).await?;
            let limit = match new.team {
                Some(_) => MAX_TEAM_WEBHOOKS,
                None => MAX_ORGANISER_WEBHOOKS,
            };
            if webhooks::count(tx, new.team).await? >= limit {
                return StoreError::conflict(format!(
                    "there are {limit} webhooks already, which is the limit: remove one (DELETE \
                     /api/v1/webhooks/ID)"
                ));
            }
            let webhook = Webhook {
                id: WebhookId::new(),
                team: new.team,
                name: new.name,
                url: new.url,
                topics: new.topics,
                creator,
                created_at: now,
                seen: events::newest_id(tx).await?,
                failing_since: None,
                disabled: None,
                old_secret_until: None,
            };
            webhooks::insert(tx, &webhook, new.secret).await?;
            let event = Event::WebhookCreated {
                webhook: webhook.id,
                name: webhook.name.clone(),
            };
            tx.record(subject(&webhook), event);
            webhooks::find(tx, webhook.id).await
        })
        .await
    }

    /// Changes a webhook.
    #[boxed_future]
    pub async fn change_webhook(
        &self,
        actor: Actor,
        id: WebhookId,
        change: WebhookChange,
        now: Timestamp,
    ) -> Result<Webhook> {
        self.write(actor, now, async |tx| {
            let creator = requester::check(tx, &change.requester, now).await?;
            let current = webhooks::find(tx, id).await?;
            let mut webhook = current.clone();
            webhook.name = change.name.unwrap_or(webhook.name);
            webhook.url = change.url.unwrap_or(webhook.url);
            if webhook.url != current.url {
                // Failures of the old address do not count for the new one.
                webhook.failing_since = None;
                webhook.creator = creator;
            }
            webhook.topics = change.topics.unwrap_or(webhook.topics);
            if change.enable && webhook.disabled.is_some() {
                webhook.disabled = None;
                webhook.failing_since = None;
                webhook.creator = creator;
                webhook.seen = events::newest_id(tx).await?;
            }
            if webhook != current {
                webhooks::update(tx, &webhook).await?;
                let name = webhook.name.clone();
                tx.record(
                    subject(&webhook),
                    Event::WebhookChanged { webhook: id, name },
                );
            }
            webhooks::find(tx, id).await
        })
        .await
    }

    /// Replaces a webhook's secret; the old one also signs for [`OLD_SECRET_VALID_FOR`].
    #[boxed_future]
    pub async fn rotate_webhook(
        &self,
        actor: Actor,
        id: WebhookId,
        secret: [u8; 32],
        now: Timestamp,
    ) -> Result<Webhook> {
        self.write(actor, now, async |tx| {
            let webhook = webhooks::find(tx, id).await?;
            webhooks::set_secret(
                tx,
                id,
                secret,
                now.saturating_add(OLD_SECRET_VALID_FOR).unwrap_or(now),
            )
            .await?;
            let name = webhook.name.clone();
            tx.record(
                subject(&webhook),
                Event::WebhookRotated { webhook: id, name },
            );
            webhooks::find(tx, id).await
        })
        .await
    }

    /// Removes a webhook with its deliveries.
    #[boxed_future]
    pub async fn remove_webhook(&self, actor: Actor, id: WebhookId, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            let webhook = webhooks::find(tx, id).await?;
            webhooks::delete(tx, id).await?;
            let name = webhook.name.clone();
            tx.record(
                subject(&webhook),
                Event::WebhookRemoved { webhook: id, name },
            );
            Ok(())
        })
        .await
    }

    /// Enabled webhooks that have not seen the newest events and are below the limit of pending deliveries.
    #[boxed_future]
    pub async fn webhooks_with_new_events(&self) -> Result<Vec<Webhook>> {
        let mut connection = self.database.read.acquire().await?;
        let newest = events::newest_id(&mut connection).await?;
        webhooks::with_new_events(&mut connection, newest, MAX_PENDING_DELIVERIES).await
    }

    /// Adds planned deliveries. The plan of a webhook is skipped if another call has planned deliveries of it meanwhile.
    #[boxed_future]
    pub async fn plan_deliveries(
        &self,
        planned: Vec<PlannedDeliveries>,
        now: Timestamp,
    ) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            for PlannedDeliveries {
                webhook,
                seen_event,
                last_event,
                bodies,
            } in planned
            {
                let current = match webhooks::find(tx, webhook).await {
                    Err(StoreError::NotFound(_)) => continue,
                    found => found?,
                };
                if current.seen != seen_event || current.disabled.is_some() {
                    continue;
                }
                for (event, kind, body) in bodies {
                    let delivery = new_delivery(webhook, Some(event), kind, body, now);
                    deliveries::insert(tx, &delivery).await?;
                }
                webhooks::set_seen(tx, webhook, last_event).await?;
            }
            Ok(())
        })
        .await
    }

    /// Queues a test message to a webhook. [`StoreError::Conflict`] if it is disabled, or a test message is pending.
    #[boxed_future]
    pub async fn test_webhook(
        &self,
        id: WebhookId,
        kind: &str,
        body: &str,
        now: Timestamp,
    ) -> Result<Delivery> {
        self.write(Actor::Server, now, async |tx| {
            let webhook = webhooks::find(tx, id).await?;
            if let Some(disabled) = webhook.disabled {
                return StoreError::conflict(format!(
                    "the webhook is disabled since {} ({}): enable it first (PATCH /api/v1/webhooks/ID with \
                     {{\"state\":\"alive\"}})",
                    disabled.at.strftime("%Y-%m-%d %H:%M UTC"),
                    disabled.reason
                ));
            }
            let newest = deliveries::of_webhook(tx, id, MAX_PENDING_DELIVERIES).await?;
            // Only test messages have no event.
            let is_pending = newest.iter().any(|delivery| {
                delivery.event.is_none() && matches!(delivery.state, DeliveryState::Pending { .. })
            });
            if is_pending {
                return StoreError::conflict(
                    "a test message is pending already: GET /api/v1/webhooks/ID/deliveries shows its result",
                );
            }
            let delivery = new_delivery(id, None, kind.to_owned(), body.to_owned(), now);
            deliveries::insert(tx, &delivery).await?;
            // A test message has no event, but the task that sends deliveries must wake up.
            tx.record_progress(Subject::Season);
            deliveries::find(tx, delivery.id).await
        })
        .await
    }

    /// The oldest due delivery of each webhook at `now`, the oldest first.
    #[boxed_future]
    pub async fn due_deliveries(&self, now: Timestamp) -> Result<Vec<Delivery>> {
        deliveries::due(&mut *self.database.read.acquire().await?, now).await
    }

    /// When the next delivery is due; `None` if none is pending.
    #[boxed_future]
    pub async fn next_delivery_at(&self) -> Result<Option<Timestamp>> {
        deliveries::next_due(&mut *self.database.read.acquire().await?).await
    }

    /// Deliveries of a webhook, the newest first.
    #[boxed_future]
    pub async fn deliveries(&self, id: WebhookId, limit: u32) -> Result<Vec<Delivery>> {
        deliveries::of_webhook(&mut *self.database.read.acquire().await?, id, limit).await
    }

    /// Records a delivery attempt. A webhook that fails for [`DISABLED_AFTER`], or answers 410, is disabled.
    #[boxed_future]
    pub async fn record_attempt(
        &self,
        id: DeliveryId,
        attempt: DeliveryAttempt,
        outcome: DeliveryOutcome,
    ) -> Result<()> {
        let now = attempt.at;
        self.write(Actor::Server, now, async |tx| {
            let delivery = match deliveries::find(tx, id).await {
                // The webhook was removed during the attempt.
                Err(StoreError::NotFound(_)) => return Ok(()),
                found => found?,
            };
            let mut webhook = webhooks::find(tx, delivery.webhook).await?;
            let state = match outcome {
                DeliveryOutcome::Accepted => DeliveryState::Delivered { at: now },
                DeliveryOutcome::Failed {
                    retry_at: Some(next_at),
                } => DeliveryState::Pending { next_at },
                DeliveryOutcome::Failed { retry_at: None } | DeliveryOutcome::Gone => {
                    DeliveryState::GivenUp { at: now }
                }
            };
            deliveries::set_attempt(tx, id, &attempt, state).await?;
            if webhook.disabled.is_some() {
                deliveries::give_up(tx, webhook.id, now).await?;
                return Ok(());
            }
            let failing_since = match outcome {
                DeliveryOutcome::Accepted => None,
                DeliveryOutcome::Failed { .. } | DeliveryOutcome::Gone => {
                    Some(webhook.failing_since.unwrap_or(now))
                }
            };
            if failing_since != webhook.failing_since {
                webhook.failing_since = failing_since;
                webhooks::update(tx, &webhook).await?;
            }
            match (outcome, failing_since) {
                (DeliveryOutcome::Gone, _) => {
                    disable(
                        tx,
                        webhook,
                        "it answered 410: it does not want any more messages".into(),
                    )
                    .await
                }
                // Only after a message has failed in all its attempts: a single failure after a time without messages
                // means little.
                (DeliveryOutcome::Failed { retry_at: None }, Some(since))
                    if now.duration_since(since) >= DISABLED_AFTER =>
                {
                    let last_error = attempt.error.unwrap_or_default();
                    let hours = DISABLED_AFTER.as_hours();
                    let reason = format!(
                        "it has accepted no message for {hours} hours; last error: {last_error}"
                    );
                    disable(tx, webhook, reason).await
                }
                _ => Ok(()),
            }
        })
        .await
    }

    /// Deletes deliveries that ended at least [`DELIVERIES_KEPT_FOR`] ago. Returns the number of deliveries.
    #[boxed_future]
    pub async fn delete_old_deliveries(&self, now: Timestamp) -> Result<u64> {
        let ended_before = earlier(now, DELIVERIES_KEPT_FOR);
        self.write(Actor::Server, now, async |tx| {
            deliveries::delete_ended(tx, ended_before).await
        })
        .await
    }
}
