//! Queries of events: the record of all changes.

use crate::{
    boxed_future,
    error::Result,
    event::EventRecord,
    store::Store,
    tables::events::{self, EventFilter},
};
use jiff::Timestamp;

impl Store {
    /// The events after the one with id `after` (0: from the beginning), the oldest first, at most `limit`.
    #[boxed_future]
    pub async fn events_after(&self, after: i64, limit: u32) -> Result<Vec<EventRecord>> {
        events::after(&mut *self.database.read.acquire().await?, after, limit).await
    }

    /// The id of the newest event; 0 if there is none.
    #[boxed_future]
    pub async fn newest_event(&self) -> Result<i64> {
        events::newest_id(&mut *self.database.read.acquire().await?).await
    }

    /// When the newest event was recorded; `None` if there is none.
    #[boxed_future]
    pub async fn newest_event_at(&self) -> Result<Option<Timestamp>> {
        events::newest_at(&mut *self.database.read.acquire().await?).await
    }

    /// The id of the newest event that does not only report the progress of a run; 0 if there is none.
    #[boxed_future]
    pub async fn newest_change(&self) -> Result<i64> {
        events::newest_change(&mut *self.database.read.acquire().await?).await
    }

    /// The newest events that match the filter, the newest first, at most `limit`.
    #[boxed_future]
    pub async fn newest_events(
        &self,
        filter: &EventFilter,
        limit: u32,
    ) -> Result<Vec<EventRecord>> {
        events::newest(&mut *self.database.read.acquire().await?, filter, limit).await
    }
}
