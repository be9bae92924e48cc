//! The table of webhooks: addresses to which events are sent. The sending of one event to one webhook is a *delivery*.

use crate::{
    column::{Bytes32, Instant, Json},
    error::{Result, StoreError},
    tables::tokens::Creator,
};
use faceoff_types::{TeamId, TokenId, UserId, WebhookId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// An address to which events are sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Webhook {
    pub id: WebhookId,
    /// The owner; `None`: the organisers.
    pub team: Option<TeamId>,
    /// A label, chosen by its owner.
    pub name: String,
    pub url: String,
    /// Topics, subjects and kinds of the events that are sent; empty: all events that its owner may see.
    pub topics: Vec<String>,
    /// Who created it or chose its current address.
    pub creator: Creator,
    pub created_at: Timestamp,
    /// Id of the last event that was considered: of all events up to it those that match have their delivery.
    pub seen: i64,
    /// Time of the first failed delivery since the last success; `None` if the last one succeeded or none was sent.
    pub failing_since: Option<Timestamp>,
    /// Set while the webhook is disabled after failures.
    pub disabled: Option<DisabledWebhook>,
    /// Until when the previous secret also signs.
    pub old_secret_until: Option<Timestamp>,
}

/// Time and reason of the disabling of a webhook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisabledWebhook {
    /// When it was disabled.
    pub at: Timestamp,
    pub reason: String,
}

/// The secrets that sign a webhook's deliveries. They are stored in clear text, because signing needs them.
#[derive(Clone, PartialEq, Eq)]
pub struct WebhookSecrets {
    /// The current secret.
    pub secret: [u8; 32],
    /// The previous secret, while it still signs.
    pub old_secret: Option<[u8; 32]>,
}

impl std::fmt::Debug for WebhookSecrets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("WebhookSecrets(..)")
    }
}

struct WebhookRow {
    id: WebhookId,
    team_id: Option<TeamId>,
    name: String,
    url: String,
    about: Json<Vec<String>>,
    made_by: Option<UserId>,
    made_with: Option<TokenId>,
    created_at: Instant,
    seen: i64,
    failing_since: Option<Instant>,
    dead_at: Option<Instant>,
    dead_for: Option<String>,
    old_secret_until: Option<Instant>,
}

impl From<WebhookRow> for Webhook {
    fn from(row: WebhookRow) -> Self {
        let disabled = row.dead_at.zip(row.dead_for);
        Self {
            id: row.id,
            team: row.team_id,
            name: row.name,
            url: row.url,
            topics: row.about.0,
            creator: Creator {
                user: row.made_by,
                token: row.made_with,
            },
            created_at: row.created_at.0,
            seen: row.seen,
            failing_since: row.failing_since.map(|at| at.0),
            disabled: disabled.map(|(at, reason)| DisabledWebhook { at: at.0, reason }),
            old_secret_until: row.old_secret_until.map(|at| at.0),
        }
    }
}

/// `SELECT` of whole webhooks; the argument is the SQL after `FROM webhooks`.
macro_rules! select_webhooks {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            WebhookRow,
            "SELECT id, team_id, name, url, about, made_by, made_with, created_at, seen, failing_since, dead_at, dead_for,
                    old_secret_until
             FROM webhooks " + $tail
            $(, $argument)*
        )
    };
}

/// All webhooks, the oldest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Webhook>> {
    let rows = select_webhooks!("ORDER BY created_at, id")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Webhook::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: WebhookId) -> Result<Webhook> {
    select_webhooks!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Webhook::from)
        .ok_or(StoreError::NotFound("webhook"))
}

/// The enabled webhooks for which events up to `newest` have no deliveries yet, with at most `max_waiting` waiting
/// deliveries.
pub(crate) async fn with_new_events(
    connection: &mut SqliteConnection,
    newest: i64,
    max_waiting: u32,
) -> Result<Vec<Webhook>> {
    let rows = select_webhooks!(
        "WHERE dead_at IS NULL AND seen < ?1
           AND (SELECT COUNT(*) FROM webhook_deliveries d WHERE d.webhook_id = webhooks.id AND d.state = 'waiting') <= ?2
         ORDER BY seen, id",
        newest,
        max_waiting
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Webhook::from).collect())
}

/// The enabled webhooks that this user has made, or that were made with this token.
pub(crate) async fn enabled_created_by(
    connection: &mut SqliteConnection,
    creator: Creator,
) -> Result<Vec<Webhook>> {
    let rows = select_webhooks!(
        "WHERE (made_by = ? OR made_with = ?) AND dead_at IS NULL ORDER BY created_at, id",
        creator.user,
        creator.token
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Webhook::from).collect())
}

/// Number of an owner's webhooks.
pub(crate) async fn count(connection: &mut SqliteConnection, team: Option<TeamId>) -> Result<i64> {
    Ok(
        sqlx::query_scalar!("SELECT COUNT(*) FROM webhooks WHERE team_id IS ?", team)
            .fetch_one(connection)
            .await?,
    )
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    webhook: &Webhook,
    secret: [u8; 32],
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO webhooks (id, team_id, name, url, about, secret, made_by, made_with, created_at, seen)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        webhook.id,
        webhook.team,
        webhook.name,
        webhook.url,
        Json(&webhook.topics),
        Bytes32(secret),
        webhook.creator.user,
        webhook.creator.token,
        Instant(webhook.created_at),
        webhook.seen,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores the fields that the owner can change, and the state.
pub(crate) async fn update(connection: &mut SqliteConnection, webhook: &Webhook) -> Result<()> {
    let (dead_at, dead_for) = match &webhook.disabled {
        Some(disabled) => (Some(Instant(disabled.at)), Some(disabled.reason.clone())),
        None => (None, None),
    };
    sqlx::query!(
        "UPDATE webhooks SET name = ?, url = ?, about = ?, made_by = ?, made_with = ?, seen = ?, failing_since = ?,
                             dead_at = ?, dead_for = ? WHERE id = ?",
        webhook.name,
        webhook.url,
        Json(&webhook.topics),
        webhook.creator.user,
        webhook.creator.token,
        webhook.seen,
        webhook.failing_since.map(Instant),
        dead_at,
        dead_for,
        webhook.id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Records that all events up to `seen` have been considered, and those that match have their delivery.
pub(crate) async fn set_seen(
    connection: &mut SqliteConnection,
    id: WebhookId,
    seen: i64,
) -> Result<()> {
    sqlx::query!("UPDATE webhooks SET seen = ? WHERE id = ?", seen, id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Replaces a webhook's secret; the previous secret also signs until `old_secret_until`.
pub(crate) async fn set_secret(
    connection: &mut SqliteConnection,
    id: WebhookId,
    secret: [u8; 32],
    old_secret_until: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE webhooks SET old_secret = secret, old_secret_until = ?, secret = ? WHERE id = ?",
        Instant(old_secret_until),
        Bytes32(secret),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The secrets that sign at `now`.
pub(crate) async fn secrets(
    connection: &mut SqliteConnection,
    id: WebhookId,
    now: Timestamp,
) -> Result<WebhookSecrets> {
    let row = sqlx::query!(
        "SELECT secret, old_secret, old_secret_until AS until
         FROM webhooks WHERE id = ?",
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("webhook"))?;
    let old_signs = row.until.is_some_and(|until| now < until.0);
    Ok(WebhookSecrets {
        secret: row.secret.0,
        old_secret: row.old_secret.filter(|_| old_signs).map(|secret| secret.0),
    })
}

pub(crate) async fn delete(connection: &mut SqliteConnection, id: WebhookId) -> Result<()> {
    sqlx::query!("DELETE FROM webhooks WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}
