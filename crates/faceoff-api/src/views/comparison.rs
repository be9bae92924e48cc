//! Whether one of two agents is better, by the episodes that both played.

use faceoff_scoring::{OverallComparison, TaskComparison, WhoSolved};
use faceoff_types::{EvaluationId, Profile, Task, TeamName};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Two evaluations on the same episodes. Differences are A minus B.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparisonView {
    /// The first evaluation.
    pub a: ComparedView,
    /// The second evaluation.
    pub b: ComparedView,
    /// The date, in their stage's zone, whose episodes both played.
    pub day: Date,
    /// The rules that both were scored by.
    pub ruleset: String,
    /// The perturbations that both met.
    pub profile: Profile,
    /// By task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskComparison>,
    /// Of the overall scores.
    pub overall: OverallComparison,
    /// By task which episodes were solved by whom; absent unless it is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episodes: Option<BTreeMap<Task, WhoSolved>>,
}

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparedView {
    /// A finished one.
    pub evaluation: EvaluationId,
    /// Whose agent played.
    pub team: TeamName,
}
