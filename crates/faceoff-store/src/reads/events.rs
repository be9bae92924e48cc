use crate::{
    boxed,
    error::Result,
    event::EventRecord,
    store::Store,
    tables::events::{self, EventFilter},
};

impl Store {
    /// What happened after the event with id `after` (0: from the beginning), the oldest first,
    /// `limit` at most.
    #[boxed]
    pub async fn events_after(&self, after: i64, limit: u32) -> Result<Vec<EventRecord>> {
        events::after(&mut *self.database.read.acquire().await?, after, limit).await
    }

    /// The id of what happened last; 0 before the first.
    #[boxed]
    pub async fn newest_event(&self) -> Result<i64> {
        events::newest_id(&mut *self.database.read.acquire().await?).await
    }

    /// The id of what happened last that anything but the progress of a run may depend on; 0 before the first.
    #[boxed]
    pub async fn newest_change(&self) -> Result<i64> {
        events::newest_change(&mut *self.database.read.acquire().await?).await
    }

    /// What happened last of what the filter lets through, the newest first, `limit` at most.
    #[boxed]
    pub async fn newest_events(
        &self,
        filter: &EventFilter,
        limit: u32,
    ) -> Result<Vec<EventRecord>> {
        events::newest(&mut *self.database.read.acquire().await?, filter, limit).await
    }
}
