//! Reference agents on a board: shown to be measured against, and ranked apart.

use crate::views::task::TaskView;
use faceoff_types::{EvaluationId, Profile, Seed, Task, TeamId, TeamName, Tier};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// A baseline on a board: as any row, without a rank of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BaselineRow {
    /// The rank that it would take, if it were ranked alone among the teams.
    pub would_rank: u32,
    /// True.
    pub baseline: bool,
    /// The overall one, or the task's.
    pub tier: Tier,
    /// Probability that other episodes of the same kind would give another tier; null where the row is a mean.
    pub tier_change_probability: Option<f64>,
    /// Its name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The agent's own name.
    pub agent: Option<String>,
    /// What the row shows; of a mean, the newest of its evaluations.
    pub evaluation: EvaluationId,
    /// All that the row is made of, the earlier day first.
    pub evaluations: Vec<EvaluationId>,
    /// The date, in the stage's zone, whose episodes it played.
    pub day: Date,
    /// It is a turn beside the day's own, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_turn: Option<String>,
    /// When its score was published.
    pub finished_at: Timestamp,
    /// The rules that it was scored by.
    pub ruleset: String,
    /// The perturbations.
    pub profile: Profile,
    /// Overall score in percent.
    pub score: f64,
    /// Overall penalty points: the maximum over the tasks. Of a mean: of a day.
    pub penalty_points: f64,
    /// When all of its day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// The seed of its day's evaluations; null as in other rows.
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskView>,
}
