//! Errors in the rules and settings of a stage.

use crate::{
    InvalidLimit, InvalidMagnitude, InvalidRuntimes, InvalidWeights, MAX_DEADLINE_H,
    MAX_EPISODES_PER_TASK, TierBounds, UnknownProfile, UnknownRuleset, UnknownTask,
};

/// The largest number of evaluation days over which a board may average a team's scores.
pub const MAX_MEAN_DAYS: u32 = 100;

/// Invalid rules or settings of a stage.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidStageRules {
    /// No task, or a repeated one.
    #[error("tasks: each task at most once, and at least one")]
    Tasks,
    #[error("tasks: {0}")]
    UnknownTask(#[from] UnknownTask),
    #[error("ruleset: {0}")]
    UnknownRuleset(#[from] UnknownRuleset),
    #[error("profile: {0}")]
    UnknownProfile(#[from] UnknownProfile),
    #[error("weights: {0}")]
    Weights(#[from] InvalidWeights),
    /// Bounds of tiers, but the competition has no tiers.
    #[error("tier_bounds: the competition has no tiers, got the bounds {0}; leave them out")]
    NoTiers(TierBounds),
    #[error("episodes_per_task: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Episodes(u32),
    /// No episode per shard, or more than a task can have.
    #[error("episodes_per_shard: expected 1 to {MAX_EPISODES_PER_TASK}, got {0}")]
    Shards(u32),
    #[error("ablation_episodes: expected at most {MAX_EPISODES_PER_TASK}, got {0}")]
    Ablations(u32),
    #[error("day_deadline: expected 1 to {MAX_DEADLINE_H} hours, got {0}")]
    Deadline(u32),
    #[error("standings: a mean is of 1 to {MAX_MEAN_DAYS} days, got {0}")]
    MeanDays(u32),
    #[error("perturbations.{0}")]
    Perturbations(#[from] InvalidMagnitude),
    #[error("limits.{0}")]
    Limits(InvalidLimit),
    #[error("runtimes: {0}")]
    Runtimes(#[from] InvalidRuntimes),
    /// Quotas that allow no upload.
    #[error("uploads.{0}")]
    Uploads(InvalidLimit),
}

impl InvalidStageRules {
    /// JSON name of the invalid field.
    #[must_use]
    pub const fn field(&self) -> &'static str {
        match self {
            Self::Tasks | Self::UnknownTask(_) => "tasks",
            Self::UnknownRuleset(_) => "ruleset",
            Self::UnknownProfile(_) => "profile",
            Self::Weights(_) => "weights",
            Self::NoTiers(_) => "tier_bounds",
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
