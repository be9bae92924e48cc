//! Paired comparison of two evaluations, A and B, on the same episodes: which agent solves more, and how certain that is.

use faceoff_scoring::{OverallComparison, SolvedEpisodes, TaskComparison};
use faceoff_types::{EvaluationId, Profile, Task, TeamName};
use indexmap::IndexMap;
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Two evaluations on the same episodes. Differences are A minus B.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparisonView {
    /// The first evaluation.
    pub a: ComparedView,
    /// The second evaluation.
    pub b: ComparedView,
    /// The evaluation day of both, a date in the stage's time zone.
    pub day: Date,
    /// The ruleset of both scores.
    pub ruleset: String,
    /// Perturbation profile of both.
    pub profile: Profile,
    /// By task.
    pub tasks: IndexMap<Task, TaskComparison>,
    /// Comparison of the overall scores.
    pub overall: OverallComparison,
    /// By task, which agents solved which episodes; only if the query asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episodes: Option<IndexMap<Task, SolvedEpisodes>>,
}

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComparedView {
    /// The finished evaluation.
    pub evaluation: EvaluationId,
    /// Name of its team.
    pub team: TeamName,
}
