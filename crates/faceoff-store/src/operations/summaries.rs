use crate::{boxed, error::Result, event::Actor, store::Store, tables::episode_summaries};
use faceoff_types::RunId;
use jiff::Timestamp;

impl Store {
    /// Keeps the episode summary (JSON) of a run, in place of an earlier one. No event tells of it:
    /// what it is made from was there before.
    #[boxed]
    pub async fn keep_episode_summary(
        &self,
        run: RunId,
        version: u32,
        summary: &str,
        now: Timestamp,
    ) -> Result<()> {
        self.keep(Actor::Server, now, async |tx| {
            episode_summaries::put(tx, run, version, summary).await
        })
        .await
    }
}
