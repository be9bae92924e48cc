//! Addresses that are told of what happens.

use crate::{
    column::{Bytes32, Instant, Json},
    error::{Result, StoreError},
};
use faceoff_types::{TeamId, WebhookId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// An address that is told of what happens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Webhook {
    pub id: WebhookId,
    /// Whose; none: the organisers'.
    pub team: Option<TeamId>,
    /// What its owner calls it.
    pub name: String,
    pub url: String,
    /// What it is told of; empty: everything that its owner may know.
    pub about: Vec<String>,
    /// When it was made.
    pub created_at: Timestamp,
    /// All events until this one have become deliveries.
    pub seen: i64,
    /// Since when nothing was taken; none: the last delivery was, or none was sent.
    pub failing_since: Option<Timestamp>,
    /// Since when nothing is sent any more, and why.
    pub dead: Option<DeadWebhook>,
    /// Until when the secret before this one signs, too.
    pub old_secret_until: Option<Timestamp>,
}

/// Why a webhook is told nothing any more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeadWebhook {
    pub at: Timestamp,
    pub reason: String,
}

/// The keys of a webhook's signatures. They are stored as they are, since they sign.
#[derive(Clone, PartialEq, Eq)]
pub struct WebhookKeys {
    /// The one that was shown last.
    pub secret: [u8; 32],
    /// The one before it, for as long as it signs.
    pub old_secret: Option<[u8; 32]>,
}

impl std::fmt::Debug for WebhookKeys {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("WebhookKeys(..)")
    }
}

struct Row {
    id: Text<WebhookId>,
    team_id: Option<Text<TeamId>>,
    name: String,
    url: String,
    about: Json<Vec<String>>,
    created_at: Instant,
    seen: i64,
    failing_since: Option<Instant>,
    dead_at: Option<Instant>,
    dead_for: Option<String>,
    old_secret_until: Option<Instant>,
}

impl From<Row> for Webhook {
    fn from(row: Row) -> Self {
        let dead = row.dead_at.zip(row.dead_for);
        Self {
            id: row.id.0,
            team: row.team_id.map(|team| team.0),
            name: row.name,
            url: row.url,
            about: row.about.0,
            created_at: row.created_at.0,
            seen: row.seen,
            failing_since: row.failing_since.map(|at| at.0),
            dead: dead.map(|(at, reason)| DeadWebhook { at: at.0, reason }),
            old_secret_until: row.old_secret_until.map(|at| at.0),
        }
    }
}

/// `SELECT` of whole webhooks; the argument is what follows `FROM webhooks`.
macro_rules! select_webhooks {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            Row,
            r#"SELECT id AS "id: Text<WebhookId>", team_id AS "team_id: Text<TeamId>", name, url,
                      about AS "about: Json<Vec<String>>", created_at AS "created_at: Instant", seen,
                      failing_since AS "failing_since: Instant", dead_at AS "dead_at: Instant", dead_for,
                      old_secret_until AS "old_secret_until: Instant"
               FROM webhooks "# + $tail
            $(, $argument)*
        )
    };
}

/// All, the oldest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Webhook>> {
    let rows = select_webhooks!("ORDER BY created_at, id")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Webhook::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: WebhookId) -> Result<Webhook> {
    let id = Text(id);
    select_webhooks!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Webhook::from)
        .ok_or(StoreError::NotFound("webhook"))
}

/// Those that are alive and have not seen the event with this id, with as many deliveries waiting as these at most.
pub(crate) async fn behind(
    connection: &mut SqliteConnection,
    newest: i64,
    waiting: u32,
) -> Result<Vec<Webhook>> {
    let rows = select_webhooks!(
        "WHERE dead_at IS NULL AND seen < ?1
           AND (SELECT COUNT(*) FROM webhook_deliveries d WHERE d.webhook_id = webhooks.id AND d.state = 'waiting') <= ?2
         ORDER BY seen, id",
        newest,
        waiting
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Webhook::from).collect())
}

/// How many an owner has.
pub(crate) async fn count(connection: &mut SqliteConnection, team: Option<TeamId>) -> Result<i64> {
    let team = team.map(Text);
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
    let (id, team, secret) = (Text(webhook.id), webhook.team.map(Text), Bytes32(secret));
    let (about, created_at) = (Json(&webhook.about), Instant(webhook.created_at));
    sqlx::query!(
        "INSERT INTO webhooks (id, team_id, name, url, about, secret, created_at, seen) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        id,
        team,
        webhook.name,
        webhook.url,
        about,
        secret,
        created_at,
        webhook.seen,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Writes what its owner may change, and how it stands.
pub(crate) async fn update(connection: &mut SqliteConnection, webhook: &Webhook) -> Result<()> {
    let (id, about) = (Text(webhook.id), Json(&webhook.about));
    let failing_since = webhook.failing_since.map(Instant);
    let (dead_at, dead_for) = match &webhook.dead {
        Some(dead) => (Some(Instant(dead.at)), Some(dead.reason.clone())),
        None => (None, None),
    };
    sqlx::query!(
        "UPDATE webhooks SET name = ?, url = ?, about = ?, seen = ?, failing_since = ?, dead_at = ?, dead_for = ? WHERE id = ?",
        webhook.name,
        webhook.url,
        about,
        webhook.seen,
        failing_since,
        dead_at,
        dead_for,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// All events until this one have become deliveries of it.
pub(crate) async fn set_seen(
    connection: &mut SqliteConnection,
    id: WebhookId,
    seen: i64,
) -> Result<()> {
    let id = Text(id);
    sqlx::query!("UPDATE webhooks SET seen = ? WHERE id = ?", seen, id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Gives it another secret; the one that it has signs until then, too.
pub(crate) async fn set_secret(
    connection: &mut SqliteConnection,
    id: WebhookId,
    secret: [u8; 32],
    old_until: Timestamp,
) -> Result<()> {
    let (id, secret, old_until) = (Text(id), Bytes32(secret), Instant(old_until));
    sqlx::query!(
        "UPDATE webhooks SET old_secret = secret, old_secret_until = ?, secret = ? WHERE id = ?",
        old_until,
        secret,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// With what is signed at `now`.
pub(crate) async fn keys(
    connection: &mut SqliteConnection,
    id: WebhookId,
    now: Timestamp,
) -> Result<WebhookKeys> {
    let id = Text(id);
    let row = sqlx::query!(
        r#"SELECT secret AS "secret: Bytes32", old_secret AS "old_secret: Bytes32",
                  old_secret_until AS "until: Instant"
           FROM webhooks WHERE id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("webhook"))?;
    let signs = row.until.is_some_and(|until| now < until.0);
    Ok(WebhookKeys {
        secret: row.secret.0,
        old_secret: row.old_secret.filter(|_| signs).map(|secret| secret.0),
    })
}

pub(crate) async fn delete(connection: &mut SqliteConnection, id: WebhookId) -> Result<()> {
    let id = Text(id);
    sqlx::query!("DELETE FROM webhooks WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}
