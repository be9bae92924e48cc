//! [`RunPlan`]: the episodes and rules of a run.

use crate::error::{Result, StoreError};
use faceoff_types::{Profile, StageLimits, Task, Variation};

/// The episodes and rules of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPlan {
    /// The perturbation profile, which selects the enabled perturbations.
    pub profile: Profile,
    /// At least one, without duplicates.
    pub tasks: Vec<Task>,
    /// Episodes of each task; at least one.
    pub episodes_per_task: u32,
    /// Episodes of one shard (a part of the run that is one job); at least one. Scores do not depend on it.
    pub episodes_per_shard: u32,
    /// The run ends without a score after more agent faults than this in all its shards.
    pub max_faults: u32,
    /// The stage's deviations from the constants of the ruleset.
    pub variation: Variation,
    /// Limits of agents that override the server's configuration.
    pub limits: Box<StageLimits>,
}

impl RunPlan {
    /// Refuses a plan without episodes, or with a duplicate task.
    pub(crate) fn check(&self) -> Result<()> {
        let is_duplicate =
            |task: &Task| self.tasks.iter().filter(|other| *other == task).count() > 1;
        if self.tasks.is_empty() || self.tasks.iter().any(is_duplicate) {
            return StoreError::conflict("a plan names each task once, and at least one");
        }
        if self.episodes_per_task == 0 || self.episodes_per_shard == 0 {
            return StoreError::conflict("a plan plays at least one episode");
        }
        Ok(())
    }

    /// Number of episodes of all tasks.
    #[must_use]
    pub fn episodes_total(&self) -> u32 {
        let tasks = u32::try_from(self.tasks.len()).unwrap_or(u32::MAX);
        tasks.saturating_mul(self.episodes_per_task)
    }
}
