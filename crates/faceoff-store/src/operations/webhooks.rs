//! Webhooks: who has which, what they are told, and what came of it.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        deliveries::{self, Delivery, DeliveryAttempt, DeliveryState},
        events,
        webhooks::{self, DeadWebhook, Webhook, WebhookKeys},
    },
    write::Tx,
};
use faceoff_types::{DeliveryId, TeamId, WebhookId};
use jiff::{SignedDuration, Timestamp};

/// Webhooks of a team at a time.
pub const MAX_TEAM_WEBHOOKS: i64 = 5;
/// Webhooks of the organisers at a time.
pub const MAX_ORGANISER_WEBHOOKS: i64 = 20;
/// Deliveries of a webhook that wait at a time, nearly: what happens meanwhile becomes deliveries later.
pub const MAX_WAITING_DELIVERIES: u32 = 100;
/// For how long a secret that was replaced still signs.
pub const OLD_SECRET: SignedDuration = SignedDuration::from_hours(24);
/// A webhook that has taken nothing for so long is dead.
pub const FAILING_FOR: SignedDuration = SignedDuration::from_hours(3 * 24);
/// For how long deliveries are kept that are over.
pub const DELIVERIES_KEPT: SignedDuration = SignedDuration::from_hours(14 * 24);

/// A webhook to be made.
#[derive(Debug, Clone)]
pub struct NewWebhook {
    /// Whose; none: the organisers'.
    pub team: Option<TeamId>,
    /// What its owner calls it.
    pub name: String,
    /// Where it is; whether it may be there is the caller's to say.
    pub url: String,
    /// What it is told of.
    pub about: Vec<String>,
    /// With what it is signed.
    pub secret: [u8; 32],
}

/// What is to be otherwise; what is `None` stays.
#[derive(Debug, Clone, Default)]
pub struct WebhookChange {
    /// What its owner calls it.
    pub name: Option<String>,
    pub url: Option<String>,
    /// What it is told of.
    pub about: Option<Vec<String>>,
    /// Is one that is dead told of what happens from now on?
    pub revived: bool,
}

/// What events have become, for one webhook.
#[derive(Debug, Clone)]
pub struct PlannedDeliveries {
    pub webhook: WebhookId,
    /// Where it stood when they were planned.
    pub after: i64,
    /// All events until this one are dealt with.
    pub until: i64,
    /// The event's id, what happened, and what is sent.
    pub bodies: Vec<(i64, String, String)>,
}

/// What an attempt means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AttemptMeans {
    Taken,
    /// It is sent again then; never again, if there is no time.
    Failed {
        again_at: Option<Timestamp>,
    },
    /// The receiver wants nothing any more.
    Gone,
}

const fn subject(webhook: &Webhook) -> Subject {
    match webhook.team {
        Some(team) => Subject::Team(team),
        None => Subject::Season,
    }
}

/// One that is sent at once.
fn fresh(
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
        last: None,
        state: DeliveryState::Waiting { next_at: now },
    }
}

/// Sends nothing more to a webhook.
async fn die(tx: &mut Tx, mut webhook: Webhook, reason: String) -> Result<()> {
    let now = tx.now;
    deliveries::give_up(tx, webhook.id, now).await?;
    webhook.dead = Some(DeadWebhook {
        at: now,
        reason: reason.clone(),
    });
    webhooks::update(tx, &webhook).await?;
    let event = Event::WebhookDied {
        webhook: webhook.id,
        reason,
    };
    tx.record(subject(&webhook), event);
    Ok(())
}

impl Store {
    /// All webhooks, the oldest first.
    #[boxed]
    pub async fn webhooks(&self) -> Result<Vec<Webhook>> {
        webhooks::all(&mut *self.database.read.acquire().await?).await
    }

    /// The webhook with this id.
    #[boxed]
    pub async fn webhook(&self, id: WebhookId) -> Result<Webhook> {
        webhooks::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// With what a webhook is signed at `now`.
    #[boxed]
    pub async fn webhook_keys(&self, id: WebhookId, now: Timestamp) -> Result<WebhookKeys> {
        webhooks::keys(&mut *self.database.read.acquire().await?, id, now).await
    }

    /// Makes a webhook, which is told of what happens from now on. [`StoreError::Conflict`] if its owner has as many as
    /// one may have.
    #[boxed]
    pub async fn create_webhook(
        &self,
        actor: Actor,
        new: NewWebhook,
        now: Timestamp,
    ) -> Result<Webhook> {
        self.write(actor, now, async |tx| {
            let most = match new.team {
                Some(_) => MAX_TEAM_WEBHOOKS,
                None => MAX_ORGANISER_WEBHOOKS,
            };
            if webhooks::count(tx, new.team).await? >= most {
                return Err(StoreError::Conflict(format!(
                    "there are {most} webhooks already, and no more than that at a time: remove one (DELETE \
                     /api/v1/webhooks/ID)"
                )));
            }
            let webhook = Webhook {
                id: WebhookId::new(),
                team: new.team,
                name: new.name,
                url: new.url,
                about: new.about,
                created_at: now,
                seen: events::newest_id(tx).await?,
                failing_since: None,
                dead: None,
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

    /// Changes a webhook. One that is revived is told of what happens from now on.
    #[boxed]
    pub async fn change_webhook(
        &self,
        actor: Actor,
        id: WebhookId,
        change: WebhookChange,
        now: Timestamp,
    ) -> Result<Webhook> {
        self.write(actor, now, async |tx| {
            let before = webhooks::find(tx, id).await?;
            let mut webhook = before.clone();
            webhook.name = change.name.unwrap_or(webhook.name);
            webhook.url = change.url.unwrap_or(webhook.url);
            if webhook.url != before.url {
                // What another address did not take is not held against this one.
                webhook.failing_since = None;
            }
            webhook.about = change.about.unwrap_or(webhook.about);
            if change.revived && webhook.dead.is_some() {
                webhook.dead = None;
                webhook.failing_since = None;
                webhook.seen = events::newest_id(tx).await?;
            }
            if webhook != before {
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

    /// Gives a webhook another secret; for [`OLD_SECRET`] the old one signs, too.
    #[boxed]
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
                now.saturating_add(OLD_SECRET).unwrap_or(now),
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
    #[boxed]
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

    /// Those that are alive, have not seen what happened last, and have room for deliveries.
    #[boxed]
    pub async fn webhooks_behind(&self) -> Result<Vec<Webhook>> {
        let mut connection = self.database.read.acquire().await?;
        let newest = events::newest_id(&mut connection).await?;
        webhooks::behind(&mut connection, newest, MAX_WAITING_DELIVERIES).await
    }

    /// Notes what events have become; what another has planned meanwhile stays as it is.
    #[boxed]
    pub async fn plan_deliveries(
        &self,
        planned: Vec<PlannedDeliveries>,
        now: Timestamp,
    ) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            for PlannedDeliveries {
                webhook,
                after,
                until,
                bodies,
            } in planned
            {
                let found = match webhooks::find(tx, webhook).await {
                    Err(StoreError::NotFound(_)) => continue,
                    found => found?,
                };
                if found.seen != after || found.dead.is_some() {
                    continue;
                }
                for (event, kind, body) in bodies {
                    let delivery = fresh(webhook, Some(event), kind, body, now);
                    deliveries::insert(tx, &delivery).await?;
                }
                webhooks::set_seen(tx, webhook, until).await?;
            }
            Ok(())
        })
        .await
    }

    /// Tells a webhook something that has not happened. [`StoreError::Conflict`] if it is dead, or as much waits as may.
    #[boxed]
    pub async fn test_webhook(
        &self,
        id: WebhookId,
        kind: &str,
        body: &str,
        now: Timestamp,
    ) -> Result<Delivery> {
        self.write(Actor::Server, now, async |tx| {
            let webhook = webhooks::find(tx, id).await?;
            if let Some(dead) = webhook.dead {
                return Err(StoreError::Conflict(format!(
                    "nothing is sent there since {} ({}): revive it first (PATCH /api/v1/webhooks/ID with \
                     {{\"state\":\"alive\"}})",
                    dead.at.strftime("%Y-%m-%d %H:%M UTC"),
                    dead.reason
                )));
            }
            let newest = deliveries::of(tx, id, MAX_WAITING_DELIVERIES).await?;
            let waits = newest.iter().filter(|one| one.event.is_none()).any(|one| {
                matches!(one.state, DeliveryState::Waiting { .. })
            });
            if waits {
                return Err(StoreError::Conflict(
                    "a test waits to be sent already: GET /api/v1/webhooks/ID/deliveries shows what comes of it".into(),
                ));
            }
            let delivery = fresh(id, None, kind.to_owned(), body.to_owned(), now);
            deliveries::insert(tx, &delivery).await?;
            // Nothing has happened; whoever sends is woken all the same.
            tx.advanced(Subject::Season);
            deliveries::find(tx, delivery.id).await
        })
        .await
    }

    /// Of each webhook what has been due for longest at `now`, the longest first.
    #[boxed]
    pub async fn due_deliveries(&self, now: Timestamp) -> Result<Vec<Delivery>> {
        deliveries::due(&mut *self.database.read.acquire().await?, now).await
    }

    /// When something is to be sent next, if anything waits.
    #[boxed]
    pub async fn next_delivery(&self) -> Result<Option<Timestamp>> {
        deliveries::next_due(&mut *self.database.read.acquire().await?).await
    }

    /// What a webhook was told, the newest first.
    #[boxed]
    pub async fn deliveries(&self, id: WebhookId, limit: u32) -> Result<Vec<Delivery>> {
        deliveries::of(&mut *self.database.read.acquire().await?, id, limit).await
    }

    /// Notes what came of sending something. A webhook that takes nothing for [`FAILING_FOR`], or wants nothing, is dead.
    #[boxed]
    pub async fn note_attempt(
        &self,
        id: DeliveryId,
        attempt: DeliveryAttempt,
        means: AttemptMeans,
    ) -> Result<()> {
        let now = attempt.at;
        self.write(Actor::Server, now, async |tx| {
            let delivery = match deliveries::find(tx, id).await {
                // Its webhook was removed while it was sent.
                Err(StoreError::NotFound(_)) => return Ok(()),
                found => found?,
            };
            let mut webhook = webhooks::find(tx, delivery.webhook).await?;
            let state = match means {
                AttemptMeans::Taken => DeliveryState::Delivered { at: now },
                AttemptMeans::Failed {
                    again_at: Some(next_at),
                } => DeliveryState::Waiting { next_at },
                AttemptMeans::Failed { again_at: None } | AttemptMeans::Gone => {
                    DeliveryState::GivenUp { at: now }
                }
            };
            deliveries::set_attempt(tx, id, &attempt, state).await?;
            if webhook.dead.is_some() {
                deliveries::give_up(tx, webhook.id, now).await?;
                return Ok(());
            }
            let failing_since = match means {
                AttemptMeans::Taken => None,
                AttemptMeans::Failed { .. } | AttemptMeans::Gone => {
                    Some(webhook.failing_since.unwrap_or(now))
                }
            };
            if failing_since != webhook.failing_since {
                webhook.failing_since = failing_since;
                webhooks::update(tx, &webhook).await?;
            }
            match (means, failing_since) {
                (AttemptMeans::Gone, _) => {
                    die(
                        tx,
                        webhook,
                        "it answered 410: it wants nothing any more".into(),
                    )
                    .await
                }
                // By a message that was sent again and again: one that failed once after a quiet time says little.
                (AttemptMeans::Failed { again_at: None }, Some(since))
                    if now.duration_since(since) >= FAILING_FOR =>
                {
                    let why = attempt.error.unwrap_or_default();
                    let hours = FAILING_FOR.as_hours();
                    let reason =
                        format!("it has taken nothing for {hours} hours; the last time: {why}");
                    die(tx, webhook, reason).await
                }
                _ => Ok(()),
            }
        })
        .await
    }

    /// Forgets deliveries that were over [`DELIVERIES_KEPT`] ago. How many.
    #[boxed]
    pub async fn forget_deliveries(&self, now: Timestamp) -> Result<u64> {
        let before = now
            .saturating_sub(DELIVERIES_KEPT)
            .unwrap_or(Timestamp::MIN);
        self.write(Actor::Server, now, async |tx| {
            deliveries::forget(tx, before).await
        })
        .await
    }
}
