//! Stages: parts of the season, each with its own evaluation days, rules and board (table of results). Each day starts at
//! a *cutoff*, when the submissions to evaluate are fixed.

use crate::views::{
    capacity::DayLoad, day::NextCutoff, decision::DecisionView, sign_off::SignOffView,
};
use faceoff_types::{
    IanaTimeZone, Retention, StageId, StageName, StageRules, StageSettings, deprecated_names,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A stage of the season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct StageView {
    /// Id of the stage; the seeds of its days derive from it.
    pub id: StageId,
    /// Name of the stage.
    pub name: StageName,
    /// The current phase.
    pub phase: PhaseView,
    /// When the stage opens: its days may start, and its rules are fixed.
    pub opens_at: Timestamp,
    /// When the stage closes: no further day starts; null: no end.
    pub closes_at: Option<Timestamp>,
    /// Time zone of its days and its schedule.
    pub zone: IanaTimeZone,
    /// The stage's next cutoff; null if there is none.
    pub next_cutoff: Option<NextCutoff>,
    /// If its boards are frozen: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<DecisionView>,
    /// Whether the seeds of its days derive from its id. False only for the first stage of a season that began with an
    /// older version.
    pub names_seeds: bool,
    /// Whether its rules and settings are read from the server's configuration at each start.
    pub configured: bool,
    /// When and by whom its result was signed off; the stage is final then. Null while its result is provisional.
    #[serde(rename = "finalised")]
    pub sign_off: Option<SignOffView>,
    /// Which of its datasets and bundles are kept; `{}`: all.
    #[serde(default)]
    pub retention: Retention,
    /// Settings that do not affect scores.
    #[serde(flatten)]
    pub settings: StageSettings,
    /// The current rules, which affect scores.
    #[serde(flatten)]
    pub rules: RevisionView,
    /// All revisions of its rules, oldest first. A board shows results of one revision.
    pub revisions: Vec<RevisionView>,
    /// Capacity forecast of its running days and the next one; for organisers only, absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity: Option<Vec<DayLoad>>,
}
deprecated_names!(StageView { next_cut => next_cutoff });

/// Phase of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseView {
    /// It has not opened yet.
    Upcoming,
    /// It has opened and not closed: its days can start.
    Open,
    /// It has closed.
    Closed,
}

/// A revision of a stage's rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RevisionView {
    /// From 1.
    pub revision: u32,
    /// When it took effect.
    pub since: Timestamp,
    /// The rules.
    #[serde(flatten)]
    pub rules: StageRules,
}
