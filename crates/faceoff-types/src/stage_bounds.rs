use crate::{
    InvalidLimit, InvalidPerturbation, InvalidRuntimes, LONGEST_DEADLINE_H, MAX_EPISODES_PER_TASK,
};

/// The most days that a row of a board is a mean of.
pub const MAX_MEAN_DAYS: u32 = 100;

/// Rules or settings by which nothing could be played.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidStageRules {
    /// No task, or one twice.
    #[error("tasks: each task at most once, and at least one")]
    Tasks,
    /// None, or more than are ever played.
    #[error("episodes_per_task: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Episodes(u32),
    /// None, or more than are ever played.
    #[error("episodes_per_shard: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Shards(u32),
    /// More than are ever played.
    #[error("ablation_episodes: expected at most {MAX_EPISODES_PER_TASK}, got {0}")]
    Ablations(u32),
    /// A day without time, or with more than any has.
    #[error("day_deadline: expected 1 to {LONGEST_DEADLINE_H} hours, got {0}")]
    Deadline(u32),
    /// A mean of no days, or of more than a board is made of.
    #[error("standings: a mean is of 1 to {MAX_MEAN_DAYS} days, got {0}")]
    MeanDays(u32),
    /// Magnitudes that no world has.
    #[error("perturbations.{0}")]
    Perturbations(#[from] InvalidPerturbation),
    /// Limits that no agent can live by.
    #[error("limits.{0}")]
    Limits(InvalidLimit),
    /// Runtimes that no agent can have.
    #[error("runtimes: {0}")]
    Runtimes(#[from] InvalidRuntimes),
    /// Quotas that let nothing through.
    #[error("uploads.{0}")]
    Uploads(InvalidLimit),
}

impl InvalidStageRules {
    /// The field that is wrong, as JSON has it.
    #[must_use]
    pub const fn field(&self) -> &'static str {
        match self {
            Self::Tasks => "tasks",
            Self::Episodes(_) => "episodes_per_task",
            Self::Shards(_) => "episodes_per_shard",
            Self::Ablations(_) => "ablation_episodes",
            Self::Deadline(_) => "day_deadline",
            Self::MeanDays(_) => "standings",
            Self::Perturbations(_) => "perturbations",
            Self::Limits(_) => "limits",
            Self::Runtimes(_) => "runtimes",
            Self::Uploads(_) => "uploads",
        }
    }
}
