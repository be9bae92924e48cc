//! Capacity forecast: whether the evaluations of a day will finish on the available slots (each runs one job at a time)
//! before the day's deadline.

use faceoff_types::{StageId, StageName};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Capacity forecast of a stage's days: the running days in order of their cutoffs, then the next day with the
/// currently active submissions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CapacityView {
    /// The stage.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// Jobs that run in parallel.
    pub slots: u32,
    /// Each day on its own; work of other days in the queue is not included.
    pub days: Vec<DayLoad>,
}

/// Remaining work of an evaluation day, and the time for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DayLoad {
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// Whether the day's cutoff has passed.
    pub is_under_way: bool,
    /// Teams with episodes left; for a future day, teams with an active submission.
    pub teams: u32,
    /// Episodes left, over all teams.
    pub episodes: u32,
    /// Expected hours on all slots, from durations of the last seven days; null without measurements.
    pub expected_hours: Option<f64>,
    /// Hours on all slots if every agent uses up its time limits.
    pub worst_case_hours: f64,
    /// When evaluations that are not finished are ended; null: no deadline.
    pub deadline_at: Option<Timestamp>,
    /// Hours from now, or from the day's cutoff, to the deadline; null: no deadline.
    pub hours_until_deadline: Option<f64>,
    /// Whether the day's evaluations finish before its deadline.
    pub fit: Fit,
    /// The forecast in words, with advice.
    pub summary: String,
}

/// Whether a day's evaluations finish before its deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Yes, even if every agent uses up its time limits.
    Surely,
    /// Yes, by the measured durations; not if every agent uses up its time limits.
    Probably,
    /// No durations are measured yet, and the evaluations do not finish if every agent uses up its time limits.
    Unknown,
    /// No, not even by the measured durations.
    Not,
}
