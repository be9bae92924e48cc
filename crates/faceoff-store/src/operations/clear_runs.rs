//! Clearing of old runs: their shards (rows with the outcomes of a part of the episodes) are removed from the database, which would
//! grow without bound otherwise.
//! A run's summary and its dataset remain.

use crate::{
    boxed_future,
    error::Result,
    event::Actor,
    operations::{
        cleanup::{RECORDINGS_KEPT_FOR, earlier},
        runs as run_owners,
    },
    store::Store,
    tables::{events, runs, shards},
};
use faceoff_types::RunId;
use jiff::Timestamp;

impl Store {
    /// Runs that ended at least [`RECORDINGS_KEPT_FOR`] ago and still have their shards, the oldest first. Completed runs without
    /// an episode summary of this format version are left out: the summary is made from the shards.
    #[boxed_future]
    pub async fn clearable_runs(&self, summary_version: u32, now: Timestamp) -> Result<Vec<RunId>> {
        let ended_before = earlier(now, RECORDINGS_KEPT_FOR);
        let mut connection = self.database.read.acquire().await?;
        runs::clearable(&mut connection, summary_version, ended_before).await
    }

    /// Removes the shards of a run that have no agent faults, with their jobs and their progress events. Shards with
    /// faults stay: they record the agent's mistakes. From then on [`Store::outcomes`] refuses the run.
    #[boxed_future]
    pub async fn clear_run(&self, run: RunId, now: Timestamp) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            shards::delete_without_faults(tx, run).await?;
            for subject in run_owners::subjects(tx, run).await? {
                events::remove_progress(tx, &subject, run).await?;
            }
            runs::set_cleared(tx, run, now).await
        })
        .await
    }
}
