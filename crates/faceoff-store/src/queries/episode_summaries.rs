//! Queries of episode summaries: statistics of a run's episodes for its board row.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::{episode_summaries, runs},
};
use faceoff_types::RunId;
use std::collections::HashMap;

impl Store {
    /// The episode summaries (JSON) of these runs. Summaries of another format version than `version`
    /// are left out.
    #[boxed_future]
    pub async fn episode_summaries(
        &self,
        runs: &[RunId],
        version: u32,
    ) -> Result<HashMap<RunId, String>> {
        let mut connection = self.database.read.acquire().await?;
        episode_summaries::of_runs(&mut connection, runs, version).await
    }

    /// Completed runs that have ended, still have their shards, and have no episode summary of this format version, the
    /// oldest first.
    #[boxed_future]
    pub async fn unsummarised_runs(&self, summary_version: u32) -> Result<Vec<RunId>> {
        let mut connection = self.database.read.acquire().await?;
        runs::unsummarised(&mut connection, summary_version).await
    }
}
