//! How a team stands today.

use crate::views::{day::NextCut, not_taken::NotTakenView, queue::QueueView, team::TeamView};
use faceoff_types::{EvaluationId, StageId, SubmissionId};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The calling team: who it is, what plays for it today and what it enters next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeView {
    /// Whose token the caller has.
    pub team: TeamView,
    /// Today's.
    pub turn: TurnView,
    /// What it enters at the next cut; null while it has no valid submission.
    pub active_submission: Option<SubmissionId>,
    /// The stages that are not over and do not take what is active: it does not play there, and why; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_taken: Vec<NotTakenView>,
    /// What waits for its smoke run or is in it, the newest first.
    pub validating: Vec<ValidatingView>,
    /// When that cut is; null if none comes.
    pub next_cut: Option<NextCut>,
    /// Largest packed bundle that the server takes, in bytes.
    pub max_bundle_bytes: u64,
}

/// What plays for a team on a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TurnView {
    /// The stage that is open.
    pub stage: StageId,
    /// The date in its zone.
    pub day: Date,
    /// The evaluation that counts; null before the day's cut, if the team had nothing active then, and
    /// if it was cancelled, voided, not played in time or failed by our fault, and is not played again.
    pub evaluation: Option<EvaluationId>,
    /// Where that stands in the queue; absent if there is none, or it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens to it next; absent if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

/// A submission that has no verdict yet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ValidatingView {
    /// Which.
    pub submission: SubmissionId,
    /// Where its smoke run stands; null when it has just ended.
    pub queue: Option<QueueView>,
    /// What happens next.
    pub next: String,
}
