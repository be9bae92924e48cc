//! Queries of runs: their shards (parts of the episodes), outcomes and agent faults.

use crate::tables::run_plan::RunPlan;
use crate::{
    boxed_future,
    error::{Result, StoreError},
    store::Store,
    tables::{
        runs as run_rows,
        shards::{self, Shard},
    },
};
use faceoff_types::{AgentFault, EpisodeOutcome, RunId};

/// How much of the agent's standard error is shown for a failed run, in bytes: the protocol's limit
/// for one shard.
const LOG_TAIL_BYTES: usize = 64 * 1024;

/// The agent faults of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunFaults {
    /// The faults in all committed shards, in order of play.
    pub faults: Vec<AgentFault>,
    /// The agent's standard error in the shards with faults, the last 64 KiB.
    pub log: String,
}

impl Store {
    /// The shards of a run with their recording keys, by task and first episode.
    #[boxed_future]
    pub async fn shards(&self, run: RunId) -> Result<Vec<Shard>> {
        shards::of_run(&mut *self.database.read.acquire().await?, run).await
    }

    /// How a run is played.
    #[boxed_future]
    pub async fn run_plan(&self, run: RunId) -> Result<RunPlan> {
        let row = run_rows::find(&mut *self.database.read.acquire().await?, run).await?;
        Ok(row.plan)
    }

    /// The outcomes of the episodes in a run's committed shards, by task and episode. Scoring needs nothing else, in
    /// particular no recording. [`StoreError::OutcomesRemoved`] if the run was cleared (its shards were removed).
    #[boxed_future]
    pub async fn outcomes(&self, run: RunId) -> Result<Vec<EpisodeOutcome>> {
        // Both reads are in one transaction: a run that is cleared between them would seem to have no outcomes.
        let mut tx = self.database.read.begin().await?;
        match run_rows::cleared_at(&mut tx, run).await? {
            None => shards::outcomes(&mut tx, run).await,
            Some(at) => Err(StoreError::OutcomesRemoved { at }),
        }
    }

    /// The agent faults of a run, with the agent's standard error.
    #[boxed_future]
    pub async fn run_faults(&self, run: RunId) -> Result<RunFaults> {
        let faulty_shards =
            shards::with_agent_faults(&mut *self.database.read.acquire().await?, run).await?;
        let mut faults = Vec::new();
        let mut log = String::new();
        for shard in faulty_shards {
            let outcomes = shard.outcomes.0.into_iter();
            faults.extend(outcomes.filter_map(|outcome| outcome.fault));
            if !shard.log.is_empty() {
                log.push_str(&format!(
                    "== {} from episode {} ==\n",
                    shard.task, shard.first_episode
                ));
                log.push_str(shard.log.trim_end());
                log.push('\n');
            }
        }
        let log = tail(&log, LOG_TAIL_BYTES).to_owned();
        Ok(RunFaults { faults, log })
    }
}

/// The last `max_bytes` bytes of a text, or slightly fewer, so that no character is split.
fn tail(text: &str, max_bytes: usize) -> &str {
    let mut start = text.len().saturating_sub(max_bytes);
    while !text.is_char_boundary(start) {
        start += 1;
    }
    &text[start..]
}

#[cfg(test)]
mod tests {
    use super::tail;

    #[test]
    fn tail_does_not_split_characters() {
        assert_eq!(tail("abc", 5), "abc");
        assert_eq!(tail("abc", 2), "bc");
        assert_eq!(tail("aéb", 2), "b");
        assert_eq!(tail("", 2), "");
    }
}
