//! Request bodies and query parameters of the API. Documentation of their fields is part of the OpenAPI document.
//!
//! A *stage* is a period of the season with rules and boards of its own. Changed rules begin a new *revision*. A *cutoff* is
//! the moment at which each team's active submission is fixed, and an *evaluation day* is all evaluations of one cutoff.

mod boards;
mod double_option;
mod episodes;
mod links;
mod merge_patch;
mod stages;
mod tournaments;
mod users;
mod webhooks;

pub use boards::*;
pub use double_option::OrNull;
pub use episodes::*;
pub use links::*;
pub use stages::*;
pub use tournaments::*;
pub use users::*;
pub use webhooks::*;

use double_option::{deserialize_some, serialize_option};
use faceoff_archive::Edition;
use faceoff_types::{EvaluationId, StageId, SubmissionId, TeamId};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::{
    IntoParams, ToSchema,
    openapi::{Object, ObjectBuilder, Type},
};

/// A team to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTeam {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    pub name: String,
}

/// Query of a comparison of two evaluations.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ComparisonQuery {
    /// Whether to return also which episodes both agents, one of them, or neither solved.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub episodes: bool,
}

/// Query of the season archive.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ArchiveQuery {
    /// `public` leaves out what only organisers may see; `organiser` is complete. Default: `organiser`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(schema_with = edition_schema, required = false)]
    pub edition: Option<Edition>,
}

fn edition_schema() -> Object {
    let names = [Edition::Public, Edition::Organiser].map(|edition| edition.to_string());
    ObjectBuilder::new()
        .schema_type(Type::String)
        .enum_values(Some(names))
        .build()
}

/// A missed evaluation day to start.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MissedDay {
    /// The day's date in the stage's time zone; in the past.
    pub day: Date,
    /// Why the day was missed. Public. 1 to 500 characters.
    pub reason: String,
}

/// One more evaluation of a team for a day.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewExtraEvaluation {
    /// The team to evaluate.
    pub team: TeamId,
    /// Why the team gets the evaluation. Public. 1 to 500 characters.
    pub reason: String,
    /// The team's name. Required if the evaluation replaces a result of the day that counts; without it the request
    /// changes nothing and the response describes the effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Filter and page of the event log.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct EventsQuery {
    /// Return only events with a smaller id: the `next_before` of the previous page.
    pub before: Option<i64>,
    /// Events per page, 1 to 1000. Default: 100.
    pub limit: Option<u32>,
    /// Return only events with this actor: `organiser` (the operator), `person:ID`, `team:ID`, `visitor`, `schedule`,
    /// `worker:NAME` or `server`. `person`, `team` and `worker` without an id match all of the kind.
    pub actor: Option<String>,
    /// Return only events about this subject: `season`, `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`,
    /// `evaluation:ID`, `ablation:ID`, `person:ID`, `registration:ID`, `announcement:ID`, `question:ID`, `proposal:ID`,
    /// `tournament:ID` or `game:ID`.
    pub subject: Option<String>,
    /// Return only events of this kind, e.g. `day_started`.
    pub kind: Option<String>,
}

/// Filter of the event stream.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct EventStreamQuery {
    /// Comma-separated filters; an event is sent if it matches one of them. Topics (`board`, `queue`, `season`, …),
    /// subjects (`stage:ID`, `team:ID`, `tournament:ID`, …) or event kinds (`day_released`). Default: all events that
    /// the caller may see.
    pub about: Option<String>,
}

/// The evaluation day to start.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartDay {
    /// The day's stage. Default: the open stage, if there is only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
}

/// A trial to start: evaluations that do not count.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// A valid submission. Default: the active submission of every team.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub submission: Option<SubmissionId>,
    /// Why the trial is started; for the event log. 1 to 500 characters.
    pub reason: String,
}

/// A re-evaluation to propose. Exactly one of `evaluation` and `day` is given.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewProposal {
    /// An evaluation that counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evaluation: Option<EvaluationId>,
    /// The date of a day; proposes all of its evaluations that count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// Whether to use the stage's newest rules, and add the results to the board of these rules. Only with `day`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub new_rules: bool,
    /// Why the re-evaluation is needed. Public once the proposal is applied. 1 to 500 characters.
    pub reason: String,
}

/// Label and note of a submission. A field that is left out stays as it is; null removes the text.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SubmissionChange {
    /// The team's name for the submission. 1 to 80 characters.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<String>)]
    pub label: Option<Option<String>>,
    /// The team's notes, any number of lines. 1 to 2000 characters.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<String>)]
    pub note: Option<Option<String>>,
}

/// Deletes the bundle of a submission for good.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DeleteSubmission {
    /// The bundle's file name. Without it the request changes nothing and the response describes the effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
    /// Why the bundle is deleted. Shown to the team. 1 to 500 characters. Required from an organiser, optional from the team.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Cancels an evaluation.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cancellation {
    /// Why the evaluation is cancelled. Shown to the team. 1 to 500 characters.
    pub reason: String,
}

/// An organiser's decision that cannot be undone, or that affects a team at once.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// The reason for the decision. Public. 1 to 500 characters.
    pub reason: String,
    /// The name of the team, or the date of the day, that the decision affects. Without it the request changes nothing
    /// and the response describes the effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Confirms a request that cannot be undone.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Confirmation {
    /// The name of the affected resource. Without it the request changes nothing and the response describes the
    /// effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// The reason for a decision.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Reason {
    /// 1 to 500 characters.
    pub reason: String,
}

/// An ablation to start: the submission is evaluated without perturbations, with each one alone and with all. All fields
/// are optional.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NewAblation {
    /// Episodes per task in each of the six profiles (`ideal`, four perturbations alone, all four). Default: 100.
    pub episodes_per_task: Option<u32>,
}

/// Closes the season.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloseSeason {
    /// The season's name. Closing cannot be undone.
    pub confirm: String,
}
