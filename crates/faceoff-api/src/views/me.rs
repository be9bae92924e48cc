//! A team's own status: today's evaluation, and the submission for the next *cutoff*, the moment at which the next
//! evaluation day starts.

use crate::views::{day::NextCutoff, exclusion::StageExclusion, queue::QueueView, team::TeamView};
use faceoff_types::{EvaluationId, StageId, SubmissionId, deprecated_names};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Status of the calling team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct MeView {
    /// The team.
    pub team: TeamView,
    /// Today's evaluation.
    pub today: TodayView,
    /// The submission that the next cutoff evaluates; null while there is no valid one.
    pub active_submission: Option<SubmissionId>,
    /// Stages that have not ended and exclude the active submission, and why; absent if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excluded_by: Vec<StageExclusion>,
    /// Submissions whose validation run is pending or running, newest first.
    pub validating: Vec<PendingValidationView>,
    /// The next cutoff; null if there is none.
    pub next_cutoff: Option<NextCutoff>,
    /// Largest bundle that the server accepts, packed, in bytes.
    pub max_bundle_bytes: u64,
}
deprecated_names!(MeView { turn => today, not_taken => excluded_by, next_cut => next_cutoff });

/// A team's evaluation of a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TodayView {
    /// The open stage.
    pub stage: StageId,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// The evaluation that counts. Null before the day's cutoff, and if the team had no active submission then. Also
    /// null if it was cancelled or voided, missed its deadline or failed by a platform fault, and is not repeated.
    pub evaluation: Option<EvaluationId>,
    /// Its position in the queue; absent without an evaluation, and once it has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next, in words; absent without an evaluation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

/// A submission without a verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PendingValidationView {
    /// Id of the submission.
    pub submission: SubmissionId,
    /// Position of its validation run in the queue; null if the run has just ended.
    pub queue: Option<QueueView>,
    /// What happens next, in words.
    pub next: String,
}
