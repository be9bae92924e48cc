//! What happened. Rows are added by [`write`](crate::write) alone, and never changed.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::{Actor, Event, EventRecord, Subject},
};
use serde_json::{Map, Value};
use sqlx::{SqliteConnection, types::Text};

/// The events after the one with id `after`, the oldest first, `limit` at most.
pub(crate) async fn after(
    connection: &mut SqliteConnection,
    after: i64,
    limit: u32,
) -> Result<Vec<EventRecord>> {
    let rows = sqlx::query!(
        r#"SELECT id, at AS "at: Instant", actor AS "actor: Text<Actor>", subject_kind, subject_id,
                  kind, payload AS "payload: Json<Map<String, Value>>"
           FROM events WHERE id > ? ORDER BY id LIMIT ?"#,
        after,
        limit,
    )
    .fetch_all(connection)
    .await?;
    rows.into_iter()
        .map(|row| {
            let damaged = |error: &dyn std::fmt::Display| {
                StoreError::Damaged(format!("event {}: {error}", row.id))
            };
            let mut fields = row.payload.0;
            fields.insert("kind".into(), row.kind.into());
            Ok(EventRecord {
                id: row.id,
                at: row.at.0,
                actor: row.actor.0,
                subject: Subject::from_columns(&row.subject_kind, &row.subject_id)
                    .map_err(|error| damaged(&error))?,
                event: serde_json::from_value::<Event>(fields.into())
                    .map_err(|error| damaged(&error))?,
            })
        })
        .collect()
}
