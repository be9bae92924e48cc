//! The table of events: the record of all changes. Only [`write`](crate::write) adds rows, and rows are never changed. Events about the progress of a
//! run are deleted with its shards.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::{Actor, Event, EventRecord, Subject},
};
use faceoff_types::RunId;
use jiff::Timestamp;
use serde_json::{Map, Value};
use sqlx::SqliteConnection;

/// Selects events; a field with `None` matches any event.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EventFilter {
    /// Only events before the one with this id.
    pub before: Option<i64>,
    /// The text of an [`Actor`], or a kind of actors, such as `team`.
    pub actor: Option<String>,
    pub subject: Option<Subject>,
    /// The event kind, such as `team_created`.
    pub kind: Option<String>,
}

struct EventRow {
    id: i64,
    at: Instant,
    actor: Actor,
    subject_kind: String,
    subject_id: String,
    kind: String,
    payload: Json<Map<String, Value>>,
}

impl TryFrom<EventRow> for EventRecord {
    type Error = StoreError;

    fn try_from(row: EventRow) -> Result<Self> {
        let damaged = |error: &dyn std::fmt::Display| {
            StoreError::Damaged(format!("event {}: {error}", row.id))
        };
        let mut fields = row.payload.0;
        fields.insert("kind".into(), row.kind.into());
        Ok(Self {
            id: row.id,
            at: row.at.0,
            actor: row.actor,
            subject: Subject::from_columns(&row.subject_kind, &row.subject_id)
                .map_err(|error| damaged(&error))?,
            event: serde_json::from_value::<Event>(fields.into())
                .map_err(|error| damaged(&error))?,
        })
    }
}

/// `SELECT` of events; the argument is the SQL after `FROM events`.
macro_rules! select_events {
    ($tail:literal $(, $argument:expr)* $(,)?) => {
        sqlx::query_as!(
            EventRow,
            "SELECT id, at, actor, subject_kind, subject_id, kind, payload FROM events " + $tail
            $(, $argument)*
        )
    };
}

/// The events after the one with id `after`, the oldest first, at most `limit`.
pub(crate) async fn after(
    connection: &mut SqliteConnection,
    after: i64,
    limit: u32,
) -> Result<Vec<EventRecord>> {
    let rows = select_events!("WHERE id > ? ORDER BY id LIMIT ?", after, limit)
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(EventRecord::try_from).collect()
}

/// The id of the newest event that does not only report a run's progress; 0 if there is none.
pub(crate) async fn newest_change(connection: &mut SqliteConnection) -> Result<i64> {
    let newest = sqlx::query_scalar!(
        r#"SELECT id AS "id!" FROM events WHERE kind NOT IN ('shard_committed', 'unit_given_back')
           ORDER BY id DESC LIMIT 1"#
    );
    Ok(newest.fetch_optional(connection).await?.unwrap_or_default())
}

/// The id of the newest event; 0 if there is none. No deleted event had a greater id: events about a run's progress are
/// deleted only after the run's end, which has a later event.
pub(crate) async fn newest_id(connection: &mut SqliteConnection) -> Result<i64> {
    let newest = sqlx::query_scalar!(r#"SELECT id AS "id!" FROM events ORDER BY id DESC LIMIT 1"#);
    Ok(newest.fetch_optional(connection).await?.unwrap_or_default())
}

/// When the newest event was recorded; `None` if there is none.
pub(crate) async fn newest_at(connection: &mut SqliteConnection) -> Result<Option<Timestamp>> {
    let newest = sqlx::query_scalar!(r#"SELECT at AS "at!" FROM events ORDER BY id DESC LIMIT 1"#);
    Ok(newest.fetch_optional(connection).await?.map(|at| at.0))
}

/// Deletes the events about a run's progress.
pub(crate) async fn remove_progress(
    connection: &mut SqliteConnection,
    subject: &Subject,
    run: RunId,
) -> Result<()> {
    let (subject_kind, subject_id) = subject.columns();
    sqlx::query!(
        "DELETE FROM events WHERE subject_kind = ? AND subject_id = ? AND kind = 'shard_committed'
                            AND payload ->> 'run' = ?",
        subject_kind,
        subject_id,
        run,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The newest events that match the filter, the newest first, at most `limit`.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    filter: &EventFilter,
    limit: u32,
) -> Result<Vec<EventRecord>> {
    let EventFilter {
        before,
        actor,
        subject,
        kind,
    } = filter;
    let before = before.unwrap_or(i64::MAX);
    // Two statements, because each uses a different index.
    let rows = match subject {
        Some(subject) => {
            let (subject_kind, subject_id) = subject.columns();
            select_events!(
                "WHERE subject_kind = ?1 AND subject_id = ?2 AND id < ?3
                   AND (?4 IS NULL OR actor = ?4 OR substr(actor, 1, length(?4) + 1) = ?4 || ':')
                   AND (?5 IS NULL OR kind = ?5)
                 ORDER BY id DESC LIMIT ?6",
                subject_kind,
                subject_id,
                before,
                actor,
                kind,
                limit,
            )
            .fetch_all(connection)
            .await?
        }
        None => {
            select_events!(
                "WHERE id < ?1
                   AND (?2 IS NULL OR actor = ?2 OR substr(actor, 1, length(?2) + 1) = ?2 || ':')
                   AND (?3 IS NULL OR kind = ?3)
                 ORDER BY id DESC LIMIT ?4",
                before,
                actor,
                kind,
                limit,
            )
            .fetch_all(connection)
            .await?
        }
    };
    rows.into_iter().map(EventRecord::try_from).collect()
}
