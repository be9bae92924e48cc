//! The season: its stages and days, the seeds that are revealed, and its *commitment*, the published hash of the secret from
//! which all seeds derive.

use crate::views::{
    archive::ArchiveView, day::NextCutoff, decision::DecisionView, stage::StageView,
};
use faceoff_types::{DivisionName, Seed, StageId, deprecated_names};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The season, as far as it is public.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct SeasonView {
    /// Name of the season.
    pub name: String,
    /// The ruleset of all scores.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// BLAKE3 hash of the season secret, 64 hexadecimal digits. All seeds derive from the secret, so they cannot be
    /// changed once the commitment is public.
    pub commitment: String,
    /// When the secret was drawn and the season began.
    pub created_at: Timestamp,
    /// When the season was closed; null while it is running.
    pub closed_at: Option<Timestamp>,
    /// If an organiser paused the queue: since when, and why. No job starts meanwhile. Absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<DecisionView>,
    /// If the server shows an archive: when it was made; absent for a running season.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub archived: Option<ArchiveView>,
    /// Whether teams can register.
    #[serde(default)]
    pub takes_registrations: bool,
    /// Names of the divisions.
    #[serde(default)]
    pub divisions: Vec<DivisionName>,
    /// The newest version of the terms; null without terms.
    #[serde(default)]
    pub terms_version: Option<u32>,
    /// The season secret, 64 hexadecimal digits; null until the season is closed.
    pub secret: Option<Seed>,
    /// The seed of the season's model mismatch, the difference between the evaluator's simulator and the one that teams have;
    /// null until the season is closed.
    pub mismatch_seed: Option<Seed>,
    /// The current date in the time zone of the open stage.
    pub today: Date,
    /// The stages, in order of their opening.
    pub stages: Vec<StageView>,
    /// The next cutoff; null if there is none.
    pub next_cutoff: Option<NextCutoff>,
    /// The evaluation days whose cutoff has passed, newest first.
    pub days: Vec<SeasonDay>,
}
deprecated_names!(SeasonView { next_cut => next_cutoff });

/// An evaluation day of the season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct SeasonDay {
    /// The day's stage.
    pub stage: StageId,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// The cutoff: each team's active submission of this moment is evaluated.
    pub cutoff_at: Timestamp,
    /// When evaluations that are not finished are ended, and the day is released; null: no deadline.
    pub deadline_at: Option<Timestamp>,
    /// When the day was released, after its last evaluation; null before.
    pub released_at: Option<Timestamp>,
    /// If the day was missed on its date and started later: the reason; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed: Option<String>,
    /// Number of finished evaluations.
    pub finished: u32,
    /// The seed of the day's evaluations; null until the day is released, and while its stage is blind, as it reveals
    /// scores.
    pub seed: Option<Seed>,
}
deprecated_names!(SeasonDay { cut_at => cutoff_at });
