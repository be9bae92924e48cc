//! Whether a day fits: what its teams play against the slots and the time that there are.

use faceoff_types::{StageId, StageName};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How the days of a stage fit into the time that they have: those that are under way, the earliest cut first, and
/// then the next one, as its teams are now.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CapacityView {
    /// Whose days.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// Units of work that are done at the same time.
    pub slots: u32,
    /// Each day for itself: what is before it in the queue is in none of its hours.
    pub days: Vec<DayLoad>,
}

/// What of a day is to be played, and until when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DayLoad {
    /// Its date in the stage's zone.
    pub day: Date,
    /// Has it had its cut?
    pub is_under_way: bool,
    /// Teams that have something left to play; of a day to come, those that have a submission active now.
    pub teams: u32,
    /// Episodes of all of them.
    pub episodes: u32,
    /// Hours that these take on all slots, by what such episodes took in the last seven days; null where nothing
    /// was measured.
    pub expected_hours: Option<f64>,
    /// The same, if every agent uses up all of its time budgets.
    pub worst_case_hours: f64,
    /// When what is left is ended; null: however long it takes.
    pub deadline_at: Option<Timestamp>,
    /// From now, or from its cut, until then.
    pub hours_until_deadline: Option<f64>,
    /// Does it fit?
    pub fit: Fit,
    /// All that in words, with what can be done.
    pub summary: String,
}

/// Does a day fit into its time?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Whatever its agents do.
    Surely,
    /// By what such episodes took of late, not by the budgets.
    Probably,
    /// Nothing was measured, and by the budgets it may not.
    Unknown,
    /// Not even by what such episodes took of late.
    Not,
}
