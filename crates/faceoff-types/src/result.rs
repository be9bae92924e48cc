//! The score of an evaluation, overall and by task.

use crate::{Profile, Seed, SlotTiming, TaskMap, Tier, Variation, ViolationCounts};
use serde::{Deserialize, Serialize};

/// Computation times over all steps of a task, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ComputationTimeSummary {
    /// Mean.
    pub mean: f64,
    /// 99th percentile (nearest rank).
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

/// The score of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TaskResult {
    /// Episodes played.
    pub episodes: u32,
    /// Episodes that ended in success.
    pub successes: u32,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    #[cfg_attr(feature = "openapi", schema(min_items = 2, max_items = 2))]
    pub success_ci95: [f64; 2],
    /// Penalty points over all episodes: the task's deployability score (DS), where fewer are better.
    pub penalty_points: f64,
    /// Episodes with each violation.
    pub violations: ViolationCounts,
    /// Tier according to the penalty points per episode; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub tier: Option<Tier>,
    /// Control steps played.
    pub steps: u64,
    /// Computation times.
    pub computation_time_s: ComputationTimeSummary,
}

/// The score of one evaluation; the layout of `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluationResult {
    pub ruleset: String,
    pub profile: Profile,
    /// Deviations from the ruleset.
    #[serde(flatten)]
    pub variation: Variation,
    /// The evaluation's seed, 64 hexadecimal digits.
    pub seed: Seed,
    pub tasks: TaskMap<TaskResult>,
    /// Overall score: the weighted mean of the tasks' success rates, in percent; tasks that were not played count as 0.
    pub score: f64,
    /// Overall DS: the maximum over the tasks.
    pub penalty_points: f64,
    /// Overall tier: the worst over the tasks; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier: Option<Tier>,
    /// Timing of the slots, with the worst value over all slots; absent in results of older versions and if
    /// nothing was played.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<SlotTiming>,
}
