//! What playing leaves in the database and nobody asks for when it is over.

use crate::{
    boxed,
    error::Result,
    event::Actor,
    operations::{runs as run_owners, tidy::RECORDINGS_KEPT},
    store::Store,
    tables::{
        events,
        runs::{self, Clearable},
        shards,
    },
};
use faceoff_types::RunId;
use jiff::Timestamp;

impl Store {
    /// The runs whose owners have been over for [`RECORDINGS_KEPT`] and which still have their shards, the oldest
    /// first.
    #[boxed]
    pub async fn clearable_runs(
        &self,
        summary_version: u32,
        now: Timestamp,
    ) -> Result<Vec<Clearable>> {
        let before = now
            .saturating_sub(RECORDINGS_KEPT)
            .unwrap_or(Timestamp::MIN);
        let mut connection = self.database.read.acquire().await?;
        runs::clearable(&mut connection, summary_version, before).await
    }

    /// The runs whose owners are over and whose episodes nobody has summed up, the oldest first.
    #[boxed]
    pub async fn unsummed_runs(&self, summary_version: u32) -> Result<Vec<RunId>> {
        let mut connection = self.database.read.acquire().await?;
        let over = runs::clearable(&mut connection, summary_version, Timestamp::MAX).await?;
        let unsummed = over.into_iter().filter(|one| one.wants_summary);
        Ok(unsummed.map(|one| one.run).collect())
    }

    /// Removes the shards of a run without agent faults, their units of work, and the events that told of them. Those
    /// with faults stay: they tell what the agent did wrong. From then on [`Store::outcomes`] refuses.
    #[boxed]
    pub async fn clear_run(&self, run: RunId, now: Timestamp) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            shards::remove_faultless(tx, run).await?;
            for subject in run_owners::subjects(tx, run).await? {
                events::remove_progress(tx, &subject, run).await?;
            }
            runs::set_cleared(tx, run, now).await
        })
        .await
    }
}
