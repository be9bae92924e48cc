//! The season's commitment, and what may be known of its seeds.

use crate::views::{archived::ArchivedView, day::NextCut, ruling::RulingView, stage::StageView};
use faceoff_types::{DivisionName, Seed, StageId};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What everybody may know of the season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeasonView {
    /// As the organiser named it.
    pub name: String,
    /// The rules that all scores refer to.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// BLAKE3 of the season secret, 64 hexadecimal digits. All seeds derive from the secret, so that
    /// nobody can change them after the commitment is known.
    pub commitment: String,
    /// When the secret was drawn and the season began.
    pub created_at: Timestamp,
    /// When it was closed; null while it runs.
    pub closed_at: Option<Timestamp>,
    /// The organiser holds the queue: since when, and why; absent otherwise. Nothing is begun meanwhile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<RulingView>,
    /// It stands still, as an archive has it; absent of a season that runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub archived: Option<ArchivedView>,
    /// May anybody register a team?
    #[serde(default)]
    pub takes_registrations: bool,
    /// That teams can be in.
    #[serde(default)]
    pub divisions: Vec<DivisionName>,
    /// The newest version of the terms; null: there are none.
    #[serde(default)]
    pub terms_version: Option<u32>,
    /// The season secret, 64 hexadecimal digits; null until the season is closed.
    pub secret: Option<Seed>,
    /// The seed of the season's model mismatch; null until the season is closed.
    pub mismatch_seed: Option<Seed>,
    /// The current date, in the zone of the stage that is open.
    pub today: Date,
    /// Its parts, the first to open first.
    pub stages: Vec<StageView>,
    /// When the next day starts, with what each team has active then; null if none does.
    pub next_cut: Option<NextCut>,
    /// The days that had their cut, the newest first.
    pub days: Vec<SeasonDay>,
}

/// A day of the season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeasonDay {
    /// Whose day.
    pub stage: StageId,
    /// Its date in the stage's zone.
    pub day: Date,
    /// When it started; what each team had active then plays it.
    pub cut_at: Timestamp,
    /// What is not played by then is ended, and the day released; null: however long it takes.
    pub deadline_at: Option<Timestamp>,
    /// When its last evaluation had ended and all of it came out; null before.
    pub released_at: Option<Timestamp>,
    /// It was missed on its date and played later, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed: Option<String>,
    /// Its finished evaluations.
    pub finished: u32,
    /// The seed of its evaluations; null until it is released, and while its stage is blind: scores follow from it.
    pub seed: Option<Seed>,
}
