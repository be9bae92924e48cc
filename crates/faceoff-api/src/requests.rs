//! What clients send to the API.

mod boards;
mod episodes;
mod field_by_field;
mod left_out;
mod links;
mod people;
mod tournaments;
mod webhooks;

pub use boards::*;
pub use episodes::*;
pub use links::*;
pub use people::*;
pub use tournaments::*;
pub use webhooks::*;

use crate::objects_only;
use faceoff_archive::Edition;
use faceoff_types::{
    DayDeadline, EvaluationId, PerturbationSettings, Profile, Publishes, Retention, Runtimes,
    Schedule, StageId, StageLimits, StageUploads, Standings, SubmissionId, Task, TaskWeights,
    TeamId, TierBounds, Zone,
};
use jiff::{Timestamp, civil::Date};
use left_out::{given, given_or_null};
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::{
    IntoParams, ToSchema,
    openapi::{Object, ObjectBuilder, Type},
};

/// A team to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTeam {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: String,
}

/// What of a comparison.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ComparisonQuery {
    /// Also which episodes were solved by both, by one and by neither.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub episodes: bool,
}

/// Which archive of the season.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ArchiveQuery {
    /// For whom: `public`, or `organiser` (which it is without this).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(schema_with = editions, required = false)]
    pub edition: Option<Edition>,
}

fn editions() -> Object {
    let names = [Edition::Public, Edition::Organiser].map(|edition| edition.to_string());
    ObjectBuilder::new()
        .schema_type(Type::String)
        .enum_values(Some(names))
        .build()
}

/// A day to be played after all.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MissedDay {
    /// Its date in the stage's zone, one that has passed.
    pub day: Date,
    /// Everybody may read it; 1 to 500 characters.
    pub reason: String,
}

/// One more evaluation of a day.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtraTurn {
    /// Whose.
    pub team: TeamId,
    /// Everybody may read it; 1 to 500 characters.
    pub reason: String,
    /// The team's name, if a result of the day that counts is to be replaced. Without it nothing is done then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Which of the log.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct EventsQuery {
    /// Only events before the one with this id: `next_before` of the page before.
    pub before: Option<i64>,
    /// Events of a page: 1 to 1000; 100 without it.
    pub limit: Option<u32>,
    /// Who caused it: `organiser` (the host), `person:ID`, `team:ID`, `visitor`, `schedule`, `worker:NAME`, `server`;
    /// `person`, `team` and `worker` name all of them.
    pub actor: Option<String>,
    /// What it is about: `season`, `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`, `evaluation:ID`, `ablation:ID`,
    /// `person:ID`, `registration:ID`, `announcement:ID`, `question:ID`, `proposal:ID`, `tournament:ID` or `game:ID`.
    pub subject: Option<String>,
    /// What happened, e.g. `day_started`.
    pub kind: Option<String>,
}

/// What of the season is followed.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FollowQuery {
    /// What fits one of these, separated by commas: topics (`board`, `queue`, `season`, …), subjects (`stage:ID`, `team:ID`,
    /// `tournament:ID`, …) or names of events (`day_released`). Without it everything that the caller may know of.
    pub about: Option<String>,
}

/// Which day is to start.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartDay {
    /// Of which stage; may be left out while one is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
}

/// A stage to make: what is left out is as in the stage that is open, or in the nearest.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewStage {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: String,
    /// From then on its days start; left out, now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opens_at: Option<Timestamp>,
    /// From then on none of its days starts; left out, it has no end yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closes_at: Option<Timestamp>,
    /// Its days are dates there, and its schedule is of its clocks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// The perturbations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// In the order of play; at least one, none twice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tasks: Option<Vec<Task>>,
    /// Episodes of each task that a team plays on a day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episodes_per_task: Option<u32>,
    /// More agent faults than this end an evaluation without a score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_faults: Option<u32>,
    /// What each task's success rate weighs in the overall score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<TaskWeights>,
    /// Penalty points per episode up to which an agent is in a tier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the perturbations that the profile switches on; what of it is left out is the ruleset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Box<PerturbationSettings>>,
    /// What agents are held to; what of it is left out is as the server's configuration has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Box<StageLimits>>,
    /// The runtimes that its agents may use, of those that the server offers; null: all of them.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<Runtimes>)]
    pub runtimes: Option<Option<Runtimes>>,
    /// What each team may upload meanwhile; likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uploads: Option<StageUploads>,
    /// When its days start; left out, when the organiser starts them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schedule: Option<Schedule>,
    /// Episodes of each task and profile of the ablation of every submission that the schedule starts; left out,
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ablation_episodes: Option<u32>,
    /// Episodes of one unit of work.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub episodes_per_shard: Option<u32>,
    /// Until when a day may be played: "next_cut", "never" or {"hours":30}; left out, until the next cut.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deadline"
    )]
    pub day_deadline: Option<DayDeadline>,
    /// Are its scores hidden from everybody but the organiser? Left out, they are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blind: Option<bool>,
    /// When its datasets are there for everybody; left out, at its close.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub publishes: Option<Publishes>,
    /// What a team's row on its board is made of; left out, its newest evaluation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standings: Option<Standings>,
    /// What is kept of its files; left out, everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retention: Option<Retention>,
}

/// What of a stage is to be another; what is left out stays as it is.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StageChange {
    /// 1 to 40 letters, digits, spaces and . _ -
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Of a stage that has not opened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opens_at: Option<Timestamp>,
    /// Of a stage that has not closed; null: it has no end yet.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<Timestamp>)]
    pub closes_at: Option<Option<Timestamp>>,
    /// Of a stage none of whose days has had its cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<Zone>,
    /// The perturbations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// In the order of play; at least one, none twice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tasks: Option<Vec<Task>>,
    /// Episodes of each task that a team plays on a day.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_task: Option<u32>,
    /// More agent faults than this end an evaluation without a score.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_faults: Option<u32>,
    /// What each task's success rate weighs in the overall score.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<TaskWeights>,
    /// Penalty points per episode up to which an agent is in a tier.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the perturbations that the profile switches on, all of them anew: what of it is left out is the
    /// ruleset's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Box<PerturbationSettings>>,
    /// What agents are held to, all of it anew: what of it is left out is as the server's configuration has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<Box<StageLimits>>,
    /// The runtimes that its agents may use, of those that the server offers; null: all of them.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<Runtimes>)]
    pub runtimes: Option<Option<Runtimes>>,
    /// What each team may upload meanwhile, all of it anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uploads: Option<StageUploads>,
    /// When its days start; null: when the organiser starts them.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<Schedule>)]
    pub schedule: Option<Option<Schedule>>,
    /// Episodes of each task and profile of the ablation of every submission that the schedule starts; 0: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ablation_episodes: Option<u32>,
    /// Episodes of one unit of work.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_shard: Option<u32>,
    /// Until when a day may be played: "next_cut", "never" or {"hours":30}; days that are under way follow.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "deadline")]
    pub day_deadline: Option<DayDeadline>,
    /// False opens a blind stage, for good once it has scores, also after its close; true only before it has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blind: Option<bool>,
    /// When its datasets are there for everybody; after its close only sooner than it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub publishes: Option<Publishes>,
    /// What a team's row on its board is made of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standings: Option<Standings>,
    /// What is kept of its files, all of it anew; `{}`: everything. Also after its close and its sign-off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retention: Option<Retention>,
    /// The stage's name, if other rules or standings are to begin while it is open (its board begins anew then, or is
    /// ordered anew), or if another retention would remove something.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// By way of a value, so that what is no deadline is told as a wrong value and not as wrong JSON.
fn deadline<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<DayDeadline>, D::Error> {
    let value = Option::<serde_json::Value>::deserialize(deserializer)?;
    let Some(value) = value else { return Ok(None) };
    objects_only::check::<DayDeadline>(&value).map_err(serde::de::Error::custom)?;
    let parsed = serde_json::from_value(value);
    parsed.map(Some).map_err(serde::de::Error::custom)
}

/// What is to be tried without counting.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// A valid one; left out, what every team has active.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub submission: Option<SubmissionId>,
    /// Kept in the log; 1 to 500 characters.
    pub reason: String,
}

/// What is to be played again beside what counts: either `evaluation` or `day`.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewProposal {
    /// One that counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evaluation: Option<EvaluationId>,
    /// All of a day that count: its date.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// By the stage's newest rules, for the board of these; of a day only.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub new_rules: bool,
    /// Everybody may read it once it is applied; 1 to 500 characters.
    pub reason: String,
}

/// What a team says of a submission; what is left out stays as it is, null takes it away.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SubmissionChange {
    /// What it calls it; 1 to 80 characters.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<String>)]
    pub label: Option<Option<String>>,
    /// What it writes about it, on any number of lines; 1 to 2000 characters.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<String>)]
    pub note: Option<Option<String>>,
}

/// That the archive of a submission is to be removed for good.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DeleteSubmission {
    /// The name of its archive. Without it nothing is done, and the answer says what would be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
    /// The team reads it; 1 to 500 characters. An organiser gives one, a team may.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Why an evaluation is stopped.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cancellation {
    /// Shown to the team; 1 to 500 characters.
    pub reason: String,
}

/// A decision of the organiser's that cannot be undone, or hits a team at once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// Everybody may read it; 1 to 500 characters.
    pub reason: String,
    /// The name of the team, or the date of the day, that it is about. Without it nothing is done, and the answer says
    /// what would be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// That something is meant as it was asked.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Confirmation {
    /// The name of what it is about. Without it nothing is done, and the answer says what would be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Why something is undone.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Reason {
    /// 1 to 500 characters.
    pub reason: String,
}

/// What the ablation shall play. All fields may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OrderAblation {
    /// Episodes of each task in each of the six profiles; 100 unless given.
    pub episodes_per_task: Option<u32>,
}

/// The wish to close the season.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloseSeason {
    /// The season's name, to show that this is no slip: closing cannot be undone.
    pub confirm: String,
}
