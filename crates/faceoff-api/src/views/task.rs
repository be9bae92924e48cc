//! The result of one task in an evaluation. Details are absent until the evaluation day is
//! *released*, that is, made public.

use faceoff_types::{ComputationTimeSummary, TaskResult, Tier, ViolationCounts};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Result of one task: success rate and penalty points; once the day is released, all that `results.json` contains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TaskView {
    /// Episodes evaluated.
    pub episodes: u32,
    /// Successful episodes.
    pub successes: u32,
    /// Fraction of successful episodes, 0 to 1.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, 0 to 1.
    #[schema(min_items = 2, max_items = 2)]
    pub success_ci95: [f64; 2],
    /// Penalty points over all episodes: the task's deployability score (DS).
    pub penalty_points: f64,
    /// Tier that follows from the penalty points; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// Number of episodes with each violation; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub violations: Option<ViolationCounts>,
    /// Number of control steps; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Computation times in seconds; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub computation_time_s: Option<ComputationTimeSummary>,
}

impl TaskView {
    /// The view of a result. The details are left out unless the day is released.
    pub fn new(result: &TaskResult, is_released: bool) -> Self {
        Self {
            episodes: result.episodes,
            successes: result.successes,
            success_rate: result.success_rate,
            success_ci95: result.success_ci95,
            penalty_points: result.penalty_points,
            tier: result.tier,
            violations: is_released.then(|| result.violations.clone()),
            steps: is_released.then_some(result.steps),
            computation_time_s: is_released.then_some(result.computation_time_s),
        }
    }
}
