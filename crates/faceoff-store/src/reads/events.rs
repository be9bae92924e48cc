use crate::{error::Result, event::EventRecord, store::Store, tables::events};

impl Store {
    /// What happened after the event with id `after` (0: from the beginning), the oldest first,
    /// `limit` at most.
    pub async fn events_after(&self, after: i64, limit: u32) -> Result<Vec<EventRecord>> {
        events::after(&mut *self.database.read.acquire().await?, after, limit).await
    }
}
