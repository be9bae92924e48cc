//! Who stands where, and how sure that is.

use crate::views::{
    baseline::BaselineRow, finalised::FinalisedView, ruling::RulingView, task::TaskView,
    team::TeamView,
};
use faceoff_types::{
    DivisionName, EvaluationId, PerturbationSettings, Profile, Seed, StageId, StageName, Standings,
    Task, TaskWeights, TeamId, TeamName, Tier, TierBounds,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// A board: of each team what the stage's standings say, of its evaluations that are finished under one revision of
/// the stage's rules, in board order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardView {
    /// Whose it is.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// By which of the stage's rules the rows were played; no board mixes two.
    pub revision: u32,
    /// Since when those were the stage's.
    pub since: Timestamp,
    /// The simulator and the scoring that the scores refer to.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// What each task's success rate weighs in the overall score.
    pub weights: TaskWeights,
    /// Penalty points per episode up to which an agent is in a tier.
    pub tier_bounds: TierBounds,
    /// Magnitudes of the perturbations that the profile switches on; absent where they are the ruleset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Box<PerturbationSettings>>,
    /// What rows are made of in the end.
    pub standings: Standings,
    /// What they are made of at the moment: before a final day, of the newest evaluations, which do not count then; or as
    /// it was asked for.
    pub rows_by: Standings,
    /// The board as it stood by the results of the days up to this one; absent where all count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// The stage is blind: without the organiser's token there are no rows until the organiser opens it.
    pub blind: bool,
    /// The result may still change: it is not signed off.
    pub provisional: bool,
    /// It is signed off, if it is.
    pub finalised: Option<FinalisedView>,
    /// The task, or null for the overall board.
    pub task: Option<Task>,
    /// Whose teams are ranked, among themselves alone; absent where all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// The level at which teams are told apart: rows of one rank group stand in the same tier and
    /// cannot be told from the group's first row.
    #[schema(example = 0.05)]
    pub significance: f64,
    /// Bootstrap resamples behind each `tier_change_probability`.
    #[schema(example = 2000)]
    pub tier_change_resamples: u32,
    /// The board shows what it showed then: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Teams that are on no board, and why.
    pub disqualified: Vec<TeamView>,
    /// Deployable teams first, then improvable, then non-deployable; inside a tier the higher score,
    /// then the fewer penalty points, then the earlier submission.
    pub rows: Vec<BoardRow>,
    /// Reference agents of the organisers', in board order, which take no rank from anybody; on the boards of all
    /// divisions.
    #[serde(default)]
    pub baselines: Vec<BaselineRow>,
}

/// One team on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardRow {
    /// Place on this board, from 1.
    pub rank: u32,
    /// Teams of one group cannot be told from the group's first; from 1 down the board.
    pub rank_group: u32,
    /// The overall one, or the task's.
    pub tier: Tier,
    /// Probability that other episodes of the same kind would give another tier; null where the row is a mean of
    /// several days, of which it is not computed.
    pub tier_change_probability: Option<f64>,
    /// The team's name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The division that the team is in now; absent if it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// The agent's own name.
    pub agent: Option<String>,
    /// What the row shows; of a mean, the newest of its evaluations.
    pub evaluation: EvaluationId,
    /// All that the row is made of, the earlier day first: one, unless it is a mean.
    pub evaluations: Vec<EvaluationId>,
    /// The date, in the stage's zone, whose episodes it played.
    pub day: Date,
    /// It is a turn beside the day's own, and why; absent otherwise. Given after the day's release it played other
    /// episodes than the other rows of the day.
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
    /// When the day's last evaluation had ended, and all of the day came out; null until then. Of a mean: null until
    /// that is so of all its days.
    pub released_at: Option<Timestamp>,
    /// The seed of the day's evaluations; null until the day is released, and where the row is a mean of several days.
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare. Of a mean, episodes, successes, violations and steps are sums over the
    /// days, rates and points are means of a day, and of the computation times `p99` and `max` are the worst day's.
    pub tasks: BTreeMap<Task, TaskView>,
}
