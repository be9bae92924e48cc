//! The day's cut: what it brought about, and when the next one is.

use crate::views::{evaluation::EvaluationView, not_taken::NotTakenTeam, team::TeamView};
use faceoff_types::{StageId, StageName, Zone};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::fmt;
use utoipa::ToSchema;

/// What starting the day did, as the organiser sees it.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct DayView {
    /// Whose day.
    pub stage: StageId,
    /// Its date in the stage's zone.
    pub day: Date,
    /// One evaluation for each team that had a submission active.
    pub created: Vec<EvaluationView>,
    /// Teams that have no valid submission; what they upload now plays another day.
    pub without_submission: Vec<TeamView>,
    /// Teams that have one whose runtime the stage does not take, and why; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_taken: Vec<NotTakenTeam>,
}

/// When the next day starts, with what each team has active then.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct NextCut {
    /// Of which stage.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// Its date in the stage's zone; the earliest, where the organiser starts it.
    pub day: Date,
    /// By the schedule; null where the organiser starts the day.
    pub at: Option<Timestamp>,
    /// Where the day is a date.
    pub zone: Zone,
}

impl fmt::Display for NextCut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(at) => {
                let there = at.to_zoned(self.zone.time_zone());
                write!(
                    f,
                    "{} {}",
                    there.strftime("%Y-%m-%d at %H:%M:%S"),
                    self.zone
                )
            }
            None => write!(
                f,
                "{} ({}) or later, when the organiser starts the day",
                self.day, self.zone
            ),
        }
    }
}
