use crate::error::{Result, StoreError};
use faceoff_types::{Profile, StageLimits, Task, Variation};

/// What a run plays.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPlan {
    /// Which perturbations are switched on.
    pub profile: Profile,
    /// At least one, none twice.
    pub tasks: Vec<Task>,
    /// Episodes of each task; at least one.
    pub episodes_per_task: u32,
    /// Episodes of one unit of work; at least one. Scores do not depend on it.
    pub episodes_per_shard: u32,
    /// More agent faults than this, summed over the run, end it without a score.
    pub max_faults: u32,
    /// What is played and scored by otherwise than the ruleset has it.
    pub variation: Variation,
    /// What agents are held to otherwise than by the server's configuration.
    pub limits: Box<StageLimits>,
}

impl RunPlan {
    /// Refuses a plan that plays nothing or a task twice.
    pub(crate) fn check(&self) -> Result<()> {
        let twice = |task: &Task| self.tasks.iter().filter(|other| *other == task).count() > 1;
        if self.tasks.is_empty() || self.tasks.iter().any(twice) {
            return Err(StoreError::Conflict(
                "a plan names each task once, and at least one".into(),
            ));
        }
        if self.episodes_per_task == 0 || self.episodes_per_shard == 0 {
            return Err(StoreError::Conflict(
                "a plan plays at least one episode".into(),
            ));
        }
        let magnitudes = self.variation.perturbations.check();
        magnitudes.map_err(|error| StoreError::Conflict(format!("perturbations.{error}")))
    }

    /// Episodes over all tasks.
    #[must_use]
    pub fn episodes_total(&self) -> u32 {
        let tasks = u32::try_from(self.tasks.len()).unwrap_or(u32::MAX);
        tasks.saturating_mul(self.episodes_per_task)
    }
}
