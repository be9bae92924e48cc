//! What each team came to on each day of a stage, and where it stood by then.

use crate::views::{ruling::RulingView, task::TaskView};
use faceoff_types::{
    DivisionName, EvaluationId, StageId, StageName, Standings, Task, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// All results of a stage that count, by one revision of its rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryView {
    /// Whose they are.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// By which of the stage's rules they were played.
    pub revision: u32,
    /// What boards of the stage are made of; ranks before a final day are by the newest results.
    pub standings: Standings,
    /// What teams were ranked by, if it was asked for something else; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<Standings>,
    /// The stage is blind: without the organiser's token there are no rows until the organiser opens it.
    pub blind: bool,
    /// The result may still change: it is not signed off.
    pub provisional: bool,
    /// The task that ranks, or null for all together.
    pub task: Option<Task>,
    /// Whose teams are ranked, among themselves alone; absent where all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Nothing is told that is newer: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Those with results, the earlier first.
    pub days: Vec<Date>,
    /// The earlier day first; of a day in board order.
    pub rows: Vec<HistoryRow>,
}

/// What a team came to on a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryRow {
    /// The date whose episodes it played.
    pub day: Date,
    /// The team's name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The division that the team is in now; absent if it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// A reference agent of the organisers, which takes no rank.
    pub baseline: bool,
    /// Where it stood on the board by the results up to that day; null of a baseline.
    pub rank: Option<u32>,
    /// The rank that a baseline would have taken; absent of others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub would_rank: Option<u32>,
    /// What it played.
    pub evaluation: EvaluationId,
    /// When its score was published.
    pub finished_at: Timestamp,
    /// When all of the day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// Of the day's own result, overall or in the task.
    pub tier: Tier,
    /// The day's own, overall, in percent.
    pub score: f64,
    /// The day's own, overall: the maximum over the tasks.
    pub penalty_points: f64,
    /// The day's own results by task.
    pub tasks: BTreeMap<Task, TaskView>,
}
