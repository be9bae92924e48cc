//! Board history: results and ranks of all teams of a stage, day by day. A *baseline* is a reference agent of the organisers. A *tier*
//! says, by the penalty points, how safe an agent is for the real robot.

use crate::views::{decision::DecisionView, task::TaskView};
use faceoff_types::{
    CountingResult, DivisionName, EvaluationId, StageId, StageName, Task, TeamId, TeamName, Tier,
};
use indexmap::IndexMap;
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// All results of a stage that count, under one revision of its rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryView {
    /// The stage.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// Revision of the stage's rules.
    pub revision: u32,
    /// Which of a team's evaluations count for boards of the stage. A stage may be decided by a
    /// final day, the evaluation day after its close; ranks before it use the newest evaluations.
    pub standings: CountingResult,
    /// Which of a team's evaluations rank it, if the query asks for others than `standings`; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<CountingResult>,
    /// The stage is blind: only organisers see rows until the stage is revealed.
    pub blind: bool,
    /// The result is not signed off and may still change.
    pub provisional: bool,
    /// The task that ranks; null for all tasks together.
    pub task: Option<Task>,
    /// Only teams of this division are ranked, among themselves; absent if all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// If the boards are frozen and newer results are left out: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<DecisionView>,
    /// Days with results, earliest first.
    pub days: Vec<Date>,
    /// Earliest day first; within a day in board order.
    pub rows: Vec<HistoryRow>,
}

/// A team's result of a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryRow {
    /// The evaluation day.
    pub day: Date,
    /// Name of the team.
    pub team: TeamName,
    /// Id of the team; stays the same when the name changes.
    pub team_id: TeamId,
    /// The team's current division; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Whether the team is a baseline, a reference agent of the organisers without a rank.
    pub baseline: bool,
    /// The team's rank by the results up to this day; null for a baseline.
    pub rank: Option<u32>,
    /// The rank that a baseline would have had; absent for other teams.
    #[serde(
        default,
        rename = "would_rank",
        skip_serializing_if = "Option::is_none"
    )]
    pub hypothetical_rank: Option<u32>,
    /// The day's evaluation.
    pub evaluation: EvaluationId,
    /// When the score was stored.
    pub finished_at: Timestamp,
    /// When the day was released; null before.
    pub released_at: Option<Timestamp>,
    /// Tier of the day's result, overall or in the task; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// Overall score of the day in percent.
    pub score: f64,
    /// Overall penalty points of the day: the maximum over the tasks.
    pub penalty_points: f64,
    /// The day's results by task.
    pub tasks: IndexMap<Task, TaskView>,
}
