//! Boards: ranks of a stage's teams, and their statistical uncertainty. If the stage counts the mean of several days, a row
//! shows a mean of several evaluations. A *revision* is one version of the stage's rules. While an organiser has *frozen*
//! the boards, they do not show new results.

use crate::views::{
    baseline::BaselineRow, decision::DecisionView, sign_off::SignOffView, task::TaskView,
    team::TeamView,
};
use faceoff_types::{
    CountingResult, DivisionName, EvaluationId, Magnitudes, Profile, Seed, StageId, StageName,
    Task, TaskWeights, TeamId, TeamName, Tier, TierBounds, deprecated_names,
};
use indexmap::IndexMap;
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A board: one row per team with finished evaluations under one revision of a stage's rules, in board order. The
/// stage's `standings` select the evaluations that count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardView {
    /// The board's stage.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// Revision of the stage's rules; a board never mixes two.
    pub revision: u32,
    /// When this revision took effect.
    pub since: Timestamp,
    /// The simulator and scoring version of the scores.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// Weight of each task's success rate in the overall score.
    pub weights: TaskWeights,
    /// For each tier, the most penalty points per episode that it allows; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the perturbations that the profile switches on; absent if they have the ruleset's values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Magnitudes>,
    /// Which of a team's evaluations count in the end.
    pub standings: CountingResult,
    /// Which of a team's evaluations the rows show: those that count, those that the query asks for, or, before a final
    /// day, the newest ones.
    pub rows_by: CountingResult,
    /// The rows use only results up to this day; absent if all days count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// The stage is blind: only organisers see rows until the stage is revealed.
    pub blind: bool,
    /// The result is not signed off and may still change.
    pub provisional: bool,
    /// When and by whom the result was signed off; null before.
    #[serde(rename = "finalised")]
    pub sign_off: Option<SignOffView>,
    /// The task; null for the overall board.
    pub task: Option<Task>,
    /// Only teams of this division are ranked, among themselves; absent if all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Significance level of the rank groups: rows of one group have the same tier and are statistically tied with the
    /// group's first row.
    #[schema(example = 0.05)]
    pub significance: f64,
    /// Number of bootstrap resamples behind each `tier_change_probability`.
    #[schema(example = 2000)]
    pub tier_change_resamples: u32,
    /// If the boards are frozen: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<DecisionView>,
    /// Teams that are left out because they are disqualified.
    pub disqualified: Vec<TeamView>,
    /// Tiers in the order deployable, improvable, non-deployable; within a tier by higher score, then by fewer penalty
    /// points, then by earlier submission.
    pub rows: Vec<BoardRow>,
    /// Reference agents of the organisers in board order, without ranks. Boards of all divisions show them.
    #[serde(default)]
    pub baselines: Vec<BaselineRow>,
}

/// A team's row on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct BoardRow {
    /// Rank on this board, from 1.
    pub rank: u32,
    /// Number of the group of statistically tied teams, from 1 down the board.
    pub rank_group: u32,
    /// The overall tier; on a task's board the task's tier; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// Probability that other episodes of the same kind would give another tier, 0 to 1; null for a mean of several
    /// days, and without tiers.
    pub tier_change_probability: Option<f64>,
    /// Name of the team.
    pub team: TeamName,
    /// Id of the team; stays the same when the name changes.
    pub team_id: TeamId,
    /// The team's current division; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Name of the agent, from its bundle.
    pub agent: Option<String>,
    /// The evaluation that the row shows; for a mean, the newest one.
    pub evaluation: EvaluationId,
    /// All evaluations that count for the row, in order of their days: several for a mean, else one.
    pub evaluations: Vec<EvaluationId>,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// If it is an extra evaluation: the reason for it; absent otherwise. One that was granted after the day's release
    /// ran on other episodes than the day's other rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_evaluation: Option<String>,
    /// Does it repeat an evaluation of the day at an organiser's request, made after the release, when the day's seed was public?
    /// Absent if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rerun_after_release: bool,
    /// When the score was stored.
    pub finished_at: Timestamp,
    /// The ruleset of the score.
    pub ruleset: String,
    /// Perturbation profile of the simulator.
    pub profile: Profile,
    /// Overall score in percent.
    pub score: f64,
    /// Overall penalty points: the maximum over the tasks. For a mean: per day.
    pub penalty_points: f64,
    /// When the day was released, after its last evaluation; null before. For a mean: null until all days are released.
    pub released_at: Option<Timestamp>,
    /// The seed of the day's evaluations; null until the day is released, and for a mean of several days.
    pub seed: Option<Seed>,
    /// Results by task. For a mean: episodes, successes, violations and steps are sums over the
    /// days; rates and points are means per day; the computation times `p99` and `max` are those of the worst day.
    pub tasks: IndexMap<Task, TaskView>,
}
deprecated_names!(BoardRow { extra_turn => extra_evaluation });
