//! The one way to change the database.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::{Actor, Change, Event, EventRecord, Subject},
    store::Store,
};
use jiff::Timestamp;
use serde_json::Value;
use sqlx::{Sqlite, SqliteConnection, Transaction, types::Text};
use std::ops::{Deref, DerefMut};

/// A change under way. It is the connection, for statements, and collects what is to be told of it.
pub(crate) struct Tx {
    transaction: Transaction<'static, Sqlite>,
    pub(crate) now: Timestamp,
    recorded: Vec<(Subject, Event)>,
    advanced: Vec<Subject>,
    work_added: bool,
}

impl Tx {
    /// Notes what happened; it is stored and told if the change is committed.
    pub(crate) fn record(&mut self, subject: Subject, event: Event) {
        self.recorded.push((subject, event));
    }

    /// Notes progress, which is told and not stored.
    pub(crate) fn advanced(&mut self, subject: Subject) {
        self.advanced.push(subject);
    }

    /// The queue has more to claim. For the queue alone.
    pub(crate) const fn work_added(&mut self) {
        self.work_added = true;
    }

    async fn append_events(&mut self, actor: &Actor) -> Result<Vec<Change>> {
        let mut told = Vec::with_capacity(self.recorded.len() + self.advanced.len());
        for (subject, event) in std::mem::take(&mut self.recorded) {
            let id = append(&mut self.transaction, actor, self.now, subject, &event).await?;
            told.push(Change::Recorded(Box::new(EventRecord {
                id,
                at: self.now,
                actor: actor.clone(),
                subject,
                event,
            })));
        }
        told.extend(self.advanced.drain(..).map(Change::Progress));
        Ok(told)
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

/// Adds one row to the events table; its id.
async fn append(
    connection: &mut SqliteConnection,
    actor: &Actor,
    at: Timestamp,
    subject: Subject,
    event: &Event,
) -> Result<i64> {
    let damaged = |what: &dyn std::fmt::Display| StoreError::Damaged(format!("an event: {what}"));
    let mut payload = serde_json::to_value(event).map_err(|error| damaged(&error))?;
    let kind = match payload
        .as_object_mut()
        .and_then(|fields| fields.remove("kind"))
    {
        Some(Value::String(kind)) => kind,
        _ => return Err(damaged(&"it has no kind")),
    };
    let (actor, at, payload) = (Text(actor), Instant(at), Json(payload));
    let (subject_kind, subject_id) = subject.columns();
    Ok(sqlx::query_scalar!(
        r#"INSERT INTO events (at, actor, subject_kind, subject_id, kind, payload)
           VALUES (?, ?, ?, ?, ?, ?) RETURNING id AS "id!""#,
        at,
        actor,
        subject_kind,
        subject_id,
        kind,
        payload,
    )
    .fetch_one(connection)
    .await?)
}

impl Store {
    /// As [`keep`](Self::keep), of a season that runs: [`StoreError::Archived`] of one that is an archive's, whatever
    /// was asked.
    pub(crate) async fn write<T>(
        &self,
        actor: Actor,
        now: Timestamp,
        change: impl AsyncFnOnce(&mut Tx) -> Result<T>,
    ) -> Result<T> {
        match self.archived() {
            None => self.keep(actor, now, change).await,
            Some(archived) => Err(StoreError::Archived {
                made_at: archived.made_at,
                imported_at: archived.imported_at,
            }),
        }
    }

    /// Runs `change` as one transaction that nobody else's write comes into: what it did and what it
    /// recorded are stored together, and then the listeners are woken. Nothing is changed and nobody
    /// woken if it fails, or if the process dies. An error of the commit itself leaves open whether
    /// it is stored.
    pub(crate) async fn keep<T>(
        &self,
        actor: Actor,
        now: Timestamp,
        change: impl AsyncFnOnce(&mut Tx) -> Result<T>,
    ) -> Result<T> {
        let mut tx = Tx {
            transaction: self.database.begin().await?,
            now,
            recorded: Vec::new(),
            advanced: Vec::new(),
            work_added: false,
        };
        let done = change(&mut tx).await?;
        let told = tx.append_events(&actor).await?;
        let committed = tx.transaction.commit().await;
        // What is not told changes nothing that is shown: deliveries, leases. An error leaves open whether it is stored.
        if committed.is_err() || !told.is_empty() {
            self.signals.committed();
        }
        committed?;
        if tx.work_added {
            self.signals.work_added();
        }
        for change in told {
            self.signals.changed(change);
        }
        self.database.log_has_grown();
        Ok(done)
    }
}
