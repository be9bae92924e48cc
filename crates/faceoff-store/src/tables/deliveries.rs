//! The table of deliveries: messages about events to webhooks. A delivery is attempted until it succeeds or is given up.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{DeliveryId, WebhookId};
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;

/// A message to a webhook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delivery {
    /// Sent to the receiver; the same in all attempts.
    pub id: DeliveryId,
    pub webhook: WebhookId,
    /// Id of the event; `None` for a test delivery.
    pub event: Option<i64>,
    /// Kind of the event.
    pub kind: String,
    pub body: String,
    pub created_at: Timestamp,
    /// Number of attempts so far.
    pub attempts: u32,
    /// Result of the last attempt, if there was one.
    pub last_attempt: Option<DeliveryAttempt>,
    pub state: DeliveryState,
}

/// State of a delivery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeliveryState {
    /// It will be sent, or sent again.
    Pending {
        /// When the next attempt is due.
        next_at: Timestamp,
    },
    Delivered {
        /// When the receiver accepted it.
        at: Timestamp,
    },
    /// It will not be sent any more.
    GivenUp {
        /// When it was given up.
        at: Timestamp,
    },
}

/// Result of a delivery attempt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeliveryAttempt {
    /// When it was made.
    pub at: Timestamp,
    /// HTTP status of the response, if there was one.
    pub status: Option<u16>,
    /// What failed, as text; `None` if the attempt succeeded.
    pub error: Option<String>,
}

struct DeliveryRow {
    id: DeliveryId,
    webhook_id: WebhookId,
    event_id: Option<i64>,
    kind: String,
    body: String,
    created_at: Instant,
    attempts: u32,
    next_at: Option<Instant>,
    is_delivered: bool,
    settled_at: Option<Instant>,
    last_at: Option<Instant>,
    last_status: Option<u16>,
    last_error: Option<String>,
}

impl TryFrom<DeliveryRow> for Delivery {
    type Error = StoreError;

    fn try_from(row: DeliveryRow) -> Result<Self> {
        let state = match (row.next_at, row.settled_at) {
            (Some(next_at), None) => DeliveryState::Pending { next_at: next_at.0 },
            (None, Some(at)) if row.is_delivered => DeliveryState::Delivered { at: at.0 },
            (None, Some(at)) => DeliveryState::GivenUp { at: at.0 },
            _ => {
                let message = format!("delivery {}: neither pending nor ended", row.id);
                return Err(StoreError::Damaged(message));
            }
        };
        Ok(Self {
            id: row.id,
            webhook: row.webhook_id,
            event: row.event_id,
            kind: row.kind,
            body: row.body,
            created_at: row.created_at.0,
            attempts: row.attempts,
            last_attempt: row.last_at.map(|at| DeliveryAttempt {
                at: at.0,
                status: row.last_status,
                error: row.last_error,
            }),
            state,
        })
    }
}

/// `SELECT` of whole deliveries; the argument is the SQL after `FROM webhook_deliveries`.
macro_rules! select_deliveries {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            DeliveryRow,
            r#"SELECT id, webhook_id, event_id, kind, body, created_at, attempts, next_at,
                      state = 'delivered' AS "is_delivered!: bool", settled_at, last_at, last_status, last_error
               FROM webhook_deliveries "# + $tail
            $(, $argument)*
        )
    };
}

fn parse_all(rows: Vec<DeliveryRow>) -> Result<Vec<Delivery>> {
    rows.into_iter().map(Delivery::try_from).collect()
}

/// Of each enabled webhook the due delivery that has waited longest, in the order in which they became due.
pub(crate) async fn due(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<Vec<Delivery>> {
    let rows = select_deliveries!(
        "WHERE id IN (SELECT first.id FROM (SELECT d.id, MIN(d.next_at) FROM webhook_deliveries d
                        INDEXED BY webhook_deliveries_due WHERE d.state = 'waiting' AND d.next_at <= ?1
                        GROUP BY d.webhook_id) first)
           AND webhook_id IN (SELECT id FROM webhooks WHERE dead_at IS NULL)
         ORDER BY next_at",
        Instant(now)
    );
    parse_all(rows.fetch_all(connection).await?)
}

/// When the next waiting delivery is due.
pub(crate) async fn next_due(connection: &mut SqliteConnection) -> Result<Option<Timestamp>> {
    let next = sqlx::query_scalar!(
        r#"SELECT next_at AS "next_at!" FROM webhook_deliveries
           WHERE state = 'waiting' AND next_at IS NOT NULL
             AND webhook_id IN (SELECT id FROM webhooks WHERE dead_at IS NULL) ORDER BY next_at LIMIT 1"#
    );
    Ok(next.fetch_optional(connection).await?.map(|at| at.0))
}

/// The deliveries of a webhook, the newest first.
pub(crate) async fn of_webhook(
    connection: &mut SqliteConnection,
    webhook: WebhookId,
    limit: u32,
) -> Result<Vec<Delivery>> {
    let rows = select_deliveries!(
        "WHERE webhook_id = ?1 ORDER BY created_at DESC, id DESC LIMIT ?2",
        webhook,
        limit
    );
    parse_all(rows.fetch_all(connection).await?)
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: DeliveryId) -> Result<Delivery> {
    let row = select_deliveries!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?;
    row.ok_or(StoreError::NotFound("delivery"))?.try_into()
}

/// Adds a delivery that is due at once.
pub(crate) async fn insert(connection: &mut SqliteConnection, delivery: &Delivery) -> Result<()> {
    sqlx::query!(
        "INSERT INTO webhook_deliveries (id, webhook_id, event_id, kind, body, created_at, attempts, next_at, state)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, 0, ?6, 'waiting')",
        delivery.id,
        delivery.webhook,
        delivery.event,
        delivery.kind,
        delivery.body,
        Instant(delivery.created_at),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores the result of an attempt and the delivery's new state.
pub(crate) async fn set_attempt(
    connection: &mut SqliteConnection,
    id: DeliveryId,
    attempt: &DeliveryAttempt,
    state: DeliveryState,
) -> Result<()> {
    let at = Instant(attempt.at);
    let (name, next_at, settled_at) = match state {
        DeliveryState::Pending { next_at } => ("waiting", Some(Instant(next_at)), None),
        DeliveryState::Delivered { at } => ("delivered", None, Some(Instant(at))),
        DeliveryState::GivenUp { at } => ("given_up", None, Some(Instant(at))),
    };
    sqlx::query!(
        "UPDATE webhook_deliveries SET attempts = attempts + 1, last_at = ?, last_status = ?, last_error = ?, state = ?,
         next_at = ?, settled_at = ? WHERE id = ?",
        at,
        attempt.status,
        attempt.error,
        name,
        next_at,
        settled_at,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Gives up all waiting deliveries of a webhook.
pub(crate) async fn give_up(
    connection: &mut SqliteConnection,
    webhook: WebhookId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE webhook_deliveries SET state = 'given_up', next_at = NULL, settled_at = ?
         WHERE webhook_id = ? AND state = 'waiting'",
        Instant(now),
        webhook,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Deletes the deliveries that ended (were delivered or given up) before an instant, and returns their number.
pub(crate) async fn delete_ended(
    connection: &mut SqliteConnection,
    ended_before: Timestamp,
) -> Result<u64> {
    let deleted = sqlx::query!(
        "DELETE FROM webhook_deliveries WHERE state <> 'waiting' AND settled_at < ?",
        Instant(ended_before)
    )
    .execute(connection)
    .await?;
    Ok(deleted.rows_affected())
}

/// Moves the times of the next attempts.
pub(crate) async fn shift(connection: &mut SqliteConnection, by: SignedDuration) -> Result<()> {
    let by_ms = i64::try_from(by.as_millis()).unwrap_or_default();
    sqlx::query!(
        "UPDATE webhook_deliveries SET next_at = next_at + ? WHERE state = 'waiting'",
        by_ms
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Makes deliveries due whose next attempt is after `latest`.
pub(crate) async fn shorten(
    connection: &mut SqliteConnection,
    latest: Timestamp,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE webhook_deliveries SET next_at = ? WHERE state = 'waiting' AND next_at > ?",
        Instant(now),
        Instant(latest),
    )
    .execute(connection)
    .await?;
    Ok(())
}
