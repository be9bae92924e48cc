//! Write transactions, the only way to change the database. Each stores its events and wakes the listeners.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::{Actor, Change, Event, EventRecord, Subject},
    store::Store,
};
use jiff::Timestamp;
use serde_json::Value;
use sqlx::{Sqlite, SqliteConnection, Transaction};
use std::ops::{Deref, DerefMut};

/// An open write transaction. It is the connection for statements, and collects the events to publish.
pub(crate) struct Tx {
    transaction: Transaction<'static, Sqlite>,
    /// The time of the change.
    pub(crate) now: Timestamp,
    events: Vec<(Subject, Event)>,
    /// Subjects of progress notifications.
    progress: Vec<Subject>,
    has_new_job: bool,
}

impl Tx {
    /// Records an event; it is stored and sent to listeners if the transaction is committed.
    pub(crate) fn record(&mut self, subject: Subject, event: Event) {
        self.events.push((subject, event));
    }

    /// Records progress on a subject, which is sent to listeners and not stored.
    pub(crate) fn record_progress(&mut self, subject: Subject) {
        self.progress.push(subject);
    }

    /// Records that the queue has another job to claim. Only the queue calls this.
    pub(crate) const fn job_added(&mut self) {
        self.has_new_job = true;
    }

    async fn append_events(&mut self, actor: &Actor) -> Result<Vec<Change>> {
        let mut changes = Vec::with_capacity(self.events.len() + self.progress.len());
        for (subject, event) in std::mem::take(&mut self.events) {
            let id = append(&mut self.transaction, actor, self.now, subject, &event).await?;
            changes.push(Change::Recorded(Box::new(EventRecord {
                id,
                at: self.now,
                actor: actor.clone(),
                subject,
                event,
            })));
        }
        changes.extend(self.progress.drain(..).map(Change::Progress));
        Ok(changes)
    }
}

impl Deref for Tx {
    type Target = SqliteConnection;
    fn deref(&self) -> &SqliteConnection {
        &self.transaction
    }
}

impl DerefMut for Tx {
    fn deref_mut(&mut self) -> &mut SqliteConnection {
        &mut self.transaction
    }
}

/// Adds one row to the events table and returns its id.
async fn append(
    connection: &mut SqliteConnection,
    actor: &Actor,
    now: Timestamp,
    subject: Subject,
    event: &Event,
) -> Result<i64> {
    let damaged =
        |problem: &dyn std::fmt::Display| StoreError::Damaged(format!("an event: {problem}"));
    let mut payload = serde_json::to_value(event).map_err(|error| damaged(&error))?;
    let kind = match payload
        .as_object_mut()
        .and_then(|fields| fields.remove("kind"))
    {
        Some(Value::String(kind)) => kind,
        _ => return Err(damaged(&"it has no kind")),
    };
    let (subject_kind, subject_id) = subject.columns();
    Ok(sqlx::query_scalar!(
        r#"INSERT INTO events (at, actor, subject_kind, subject_id, kind, payload)
           VALUES (?, ?, ?, ?, ?, ?) RETURNING id AS "id!""#,
        Instant(now),
        actor,
        subject_kind,
        subject_id,
        kind,
        Json(payload),
    )
    .fetch_one(connection)
    .await?)
}

impl Store {
    /// As [`write_even_archived`](Self::write_even_archived), but refuses all changes of an archived season with
    /// [`StoreError::Archived`].
    pub(crate) async fn write<T>(
        &self,
        actor: Actor,
        now: Timestamp,
        change: impl AsyncFnOnce(&mut Tx) -> Result<T>,
    ) -> Result<T> {
        match self.archived_season() {
            None => self.write_even_archived(actor, now, change).await,
            Some(archived) => Err(StoreError::Archived {
                made_at: archived.made_at,
                imported_at: archived.imported_at,
            }),
        }
    }

    /// Runs `change` as one isolated transaction. Its changes and its events are stored together, and
    /// then the listeners are woken. If it fails, or if the process dies, nothing is changed and no listener is
    /// woken. After an error of the commit itself it is unknown whether the change is stored.
    pub(crate) async fn write_even_archived<T>(
        &self,
        actor: Actor,
        now: Timestamp,
        change: impl AsyncFnOnce(&mut Tx) -> Result<T>,
    ) -> Result<T> {
        let mut tx = Tx {
            transaction: self.database.begin().await?,
            now,
            events: Vec::new(),
            progress: Vec::new(),
            has_new_job: false,
        };
        let output = change(&mut tx).await?;
        let changes = tx.append_events(&actor).await?;
        let committed = tx.transaction.commit().await;
        // Transactions without events (deliveries, leases) change nothing visible. After an error the commit may be stored.
        if committed.is_err() || !changes.is_empty() {
            self.signals.count_commit();
        }
        committed?;
        if tx.has_new_job {
            self.signals.job_added();
        }
        for change in changes {
            self.signals.send(change);
        }
        self.database.empty_log_if_large();
        Ok(output)
    }
}
