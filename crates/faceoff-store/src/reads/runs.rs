use crate::{
    boxed,
    error::{Result, StoreError},
    store::Store,
    tables::{
        runs as run_rows,
        shards::{self, Shard},
    },
};
use faceoff_types::{AgentFault, EpisodeOutcome, RunId, Variation};

/// How much of its agent's standard error is shown of a failed run, bytes; the protocol's bound for
/// one shard.
const LOG_TAIL_BYTES: usize = 64 * 1024;

/// What an agent did wrong in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunFaults {
    /// Every fault of the shards that were committed, in order of play.
    pub faults: Vec<AgentFault>,
    /// The agent's standard error in the shards with faults, the last 64 KiB.
    pub log: String,
}

impl Store {
    /// The shards of a run in (task, first episode) order, with recording keys.
    #[boxed]
    pub async fn shards(&self, run: RunId) -> Result<Vec<Shard>> {
        shards::of_run(&mut *self.database.read.acquire().await?, run).await
    }

    /// What a run is played and scored by otherwise than its ruleset has it.
    #[boxed]
    pub async fn run_variation(&self, run: RunId) -> Result<Variation> {
        let found = run_rows::find(&mut *self.database.read.acquire().await?, run).await?;
        Ok(found.plan.variation)
    }

    /// The outcomes of a run's committed shards in (task, episode) order: all that scoring needs,
    /// without opening a recording. Of a run that was cleared they are gone.
    #[boxed]
    pub async fn outcomes(&self, run: RunId) -> Result<Vec<EpisodeOutcome>> {
        // In one look: between two it may be cleared, and would seem to have had none.
        let mut look = self.database.read.begin().await?;
        match run_rows::cleared_at(&mut look, run).await? {
            None => shards::outcomes(&mut look, run).await,
            Some(at) => Err(StoreError::Cleared { at }),
        }
    }

    /// What the agent did wrong in a run, and what it said.
    #[boxed]
    pub async fn run_faults(&self, run: RunId) -> Result<RunFaults> {
        let faulty = shards::faulty(&mut *self.database.read.acquire().await?, run).await?;
        let mut faults = Vec::new();
        let mut log = String::new();
        for shard in faulty {
            let of_shard = shard.outcomes.0.into_iter();
            faults.extend(of_shard.filter_map(|outcome| outcome.fault));
            if !shard.log.is_empty() {
                log.push_str(&format!(
                    "== {} from episode {} ==\n",
                    shard.task.0, shard.first_episode
                ));
                log.push_str(shard.log.trim_end());
                log.push('\n');
            }
        }
        let log = tail(&log, LOG_TAIL_BYTES).to_owned();
        Ok(RunFaults { faults, log })
    }
}

/// The last `bytes` bytes, or a little less: no character is cut.
fn tail(text: &str, bytes: usize) -> &str {
    let mut start = text.len().saturating_sub(bytes);
    while !text.is_char_boundary(start) {
        start += 1;
    }
    &text[start..]
}

#[cfg(test)]
mod tests {
    use super::tail;

    #[test]
    fn a_log_is_cut_between_characters() {
        assert_eq!(tail("abc", 5), "abc");
        assert_eq!(tail("abc", 2), "bc");
        assert_eq!(tail("aéb", 2), "b");
        assert_eq!(tail("", 2), "");
    }
}
