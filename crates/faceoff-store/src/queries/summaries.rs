//! Queries of episode summaries: statistics of a run's episodes for its board row.

use crate::{boxed, error::Result, store::Store, tables::episode_summaries};
use faceoff_types::RunId;
use std::collections::HashMap;

impl Store {
    /// The episode summaries (JSON) of these runs. Summaries of another format version than `version`
    /// are left out.
    #[boxed]
    pub async fn episode_summaries(
        &self,
        runs: &[RunId],
        version: u32,
    ) -> Result<HashMap<RunId, String>> {
        let mut connection = self.database.read.acquire().await?;
        episode_summaries::of_runs(&mut connection, runs, version).await
    }
}
