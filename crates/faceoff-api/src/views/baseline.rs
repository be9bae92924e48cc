//! Baselines on a board: reference agents of the organisers, shown unranked. If the stage counts the mean of several days, a
//! row shows a mean of several evaluations.

use crate::views::task::TaskView;
use faceoff_types::{EvaluationId, Profile, Seed, Task, TeamId, TeamName, Tier, deprecated_names};
use indexmap::IndexMap;
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A baseline on a board: a row without a rank of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct BaselineRow {
    /// The rank that it would have among the teams, without the other baselines.
    #[serde(rename = "would_rank")]
    pub hypothetical_rank: u32,
    /// Always true.
    pub baseline: bool,
    /// The overall tier; on a task's board the task's tier; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// Probability that other episodes of the same kind would give another tier, 0 to 1; null for a mean of several
    /// days, and without tiers.
    pub tier_change_probability: Option<f64>,
    /// The baseline's name.
    pub team: TeamName,
    /// Id of the baseline's team; stays the same when the name changes.
    pub team_id: TeamId,
    /// Name of the agent, from its bundle.
    pub agent: Option<String>,
    /// The evaluation that the row shows; for a mean, the newest one.
    pub evaluation: EvaluationId,
    /// All evaluations that count for the row, in order of their days.
    pub evaluations: Vec<EvaluationId>,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// If it is an extra evaluation: the reason for it; absent otherwise.
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
    /// When the day was released; null before.
    pub released_at: Option<Timestamp>,
    /// The seed of the day's evaluations; null until the day is released, and for a mean of several days.
    pub seed: Option<Seed>,
    /// Results by task.
    pub tasks: IndexMap<Task, TaskView>,
}
deprecated_names!(BaselineRow { extra_turn => extra_evaluation });
