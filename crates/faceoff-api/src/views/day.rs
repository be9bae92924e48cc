//! Evaluation days. A day's *cutoff* is the moment at which each team's active submission is fixed; the day is all
//! evaluations of this cutoff.

use crate::views::{evaluation::EvaluationView, exclusion::ExcludedTeam, team::TeamView};
use faceoff_types::{IanaTimeZone, StageId, StageName, deprecated_names};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::fmt;
use utoipa::ToSchema;

/// An evaluation day, as organisers see it.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct DayView {
    /// The day's stage.
    pub stage: StageId,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// The day's evaluations: one for each team that had an active submission at the cutoff.
    #[serde(rename = "created")]
    pub evaluations: Vec<EvaluationView>,
    /// Teams without a valid submission at the cutoff. What they upload later is evaluated on another day.
    pub without_submission: Vec<TeamView>,
    /// Teams whose active submission the stage excludes, and why; absent if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excluded: Vec<ExcludedTeam>,
}
deprecated_names!(DayView { not_taken => excluded });

/// The next cutoff: the active submission of each team is evaluated.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NextCutoff {
    /// The day's stage.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// The evaluation day, a date in the stage's time zone; the earliest one if an organiser starts it.
    pub day: Date,
    /// The scheduled time; null if an organiser starts the day.
    pub at: Option<Timestamp>,
    /// Time zone of the stage.
    pub zone: IanaTimeZone,
}

impl fmt::Display for NextCutoff {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(cutoff_at) => {
                let local = cutoff_at.to_zoned(self.zone.time_zone());
                write!(
                    f,
                    "{} {}",
                    local.strftime("%Y-%m-%d at %H:%M:%S"),
                    self.zone
                )
            }
            None => write!(
                f,
                "{} ({}) at the earliest (started by the organisers)",
                self.day, self.zone
            ),
        }
    }
}
