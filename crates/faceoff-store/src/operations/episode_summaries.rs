//! Episode summaries: statistics of a run's episodes for its board row, which stay after the episodes are removed.

use crate::{boxed_future, error::Result, event::Actor, store::Store, tables::episode_summaries};
use faceoff_types::RunId;
use jiff::Timestamp;

impl Store {
    /// Stores the episode summary (JSON) of a run, replacing an earlier one. No event is recorded, since
    /// it is derived from data that is already there.
    #[boxed_future]
    pub async fn store_episode_summary(
        &self,
        run: RunId,
        version: u32,
        summary: &str,
        now: Timestamp,
    ) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            episode_summaries::put(tx, run, version, summary).await
        })
        .await
    }
}
