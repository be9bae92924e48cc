//! What an evaluation came to in one task.

use faceoff_types::{ComputationTimeSummary, TaskResult, Tier, ViolationCounts};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The result of one task: score and points, and once the day is released all that `results.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TaskView {
    /// Episodes played.
    pub episodes: u32,
    /// Episodes that ended in success.
    pub successes: u32,
    /// Fraction of successes.
    pub success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    #[schema(min_items = 2, max_items = 2)]
    pub success_ci95: [f64; 2],
    /// Penalty points over all episodes: the task's deployability score (DS).
    pub penalty_points: f64,
    /// Tier that follows from the penalty points.
    pub tier: Tier,
    /// Episodes with each violation; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub violations: Option<ViolationCounts>,
    /// Control steps played; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Computation times; absent until the day is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub computation_time_s: Option<ComputationTimeSummary>,
}

impl TaskView {
    /// Of a result: before the day is released without what tells of its episodes.
    pub fn new(result: &TaskResult, released: bool) -> Self {
        Self {
            episodes: result.episodes,
            successes: result.successes,
            success_rate: result.success_rate,
            success_ci95: result.success_ci95,
            penalty_points: result.penalty_points,
            tier: result.tier,
            violations: released.then_some(result.violations),
            steps: released.then_some(result.steps),
            computation_time_s: released.then_some(result.computation_time_s),
        }
    }
}
