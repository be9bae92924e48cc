//! A stage: when it is open, by which rules it is played, and when its next day starts.

use crate::views::{capacity::DayLoad, day::NextCut, finalised::FinalisedView, ruling::RulingView};
use faceoff_types::{Retention, StageId, StageName, StageRules, StageSettings, Zone};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A part of the season with its own days, rules and board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageView {
    /// Names the stage in paths, and enters the seeds of its days.
    pub id: StageId,
    /// As the organiser named it.
    pub name: StageName,
    /// Where it is now.
    pub phase: PhaseView,
    /// From then on its days start, and its rules are fixed.
    pub opens_at: Timestamp,
    /// From then on none of its days starts; null: it has no end yet.
    pub closes_at: Option<Timestamp>,
    /// Its days are dates there, and its schedule is of its clocks.
    pub zone: Zone,
    /// When its next day starts; null if none does.
    pub next_cut: Option<NextCut>,
    /// Its boards show what they showed then: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Do the seeds of its days follow from its id? Not of a season's first stage, if that began before there were
    /// stages.
    pub names_seeds: bool,
    /// Does it take rules and settings from the server's configuration, at each start?
    pub configured: bool,
    /// Its result is signed off, if it is: nothing of it changes any more. Null: its result is provisional.
    pub finalised: Option<FinalisedView>,
    /// What is kept of its datasets and of the archives of what has played it; `{}`: everything.
    #[serde(default)]
    pub retention: Retention,
    /// What no score depends on.
    #[serde(flatten)]
    pub settings: StageSettings,
    /// What scores depend on, as they are now.
    #[serde(flatten)]
    pub rules: RevisionView,
    /// All rules that it has had, the first ones first. A board shows results of one revision.
    pub revisions: Vec<RevisionView>,
    /// Do its days fit: those under way and the next one. For organisers, absent for everybody else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity: Option<Vec<DayLoad>>,
}

/// Where a stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PhaseView {
    /// It opens later.
    Upcoming,
    /// Its days start.
    Open,
    /// It is over.
    Closed,
}

/// Rules from one time on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RevisionView {
    /// From 1.
    pub revision: u32,
    /// When they became the stage's.
    pub since: Timestamp,
    /// Themselves.
    #[serde(flatten)]
    pub rules: StageRules,
}
