//! An evaluation on its way to a score or a failure.

pub use crate::views::evaluation_status::{EvaluationStatus, FaultView, ResultView};
use crate::views::{queue::QueueView, ruling::RulingView};
use faceoff_types::{EvaluationId, Profile, StageId, SubmissionId, Task, TeamId, TeamName};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One run of a submission over the tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvaluationView {
    /// Names the evaluation in paths.
    pub id: EvaluationId,
    /// The submission that plays.
    pub submission: SubmissionId,
    /// The submission's team.
    pub team: TeamId,
    /// As the board shows it.
    pub team_name: TeamName,
    /// Whose day it plays.
    pub stage: StageId,
    /// By which of the stage's rules.
    pub revision: u32,
    /// The date, in the stage's zone, whose episodes it plays.
    pub day: Date,
    /// When the day's last evaluation had ended, and all of the day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// What is not played by then is ended, until the day is released; null: however long it takes.
    pub deadline_at: Option<Timestamp>,
    /// The evaluation that it plays again, one that was cancelled, voided or failed by our fault; absent
    /// otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rerun_of: Option<EvaluationId>,
    /// It is a turn beside the day's own, and why; absent otherwise. Given after the day's release it plays other
    /// episodes than the day's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_turn: Option<String>,
    /// It does not count, if it was voided; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voided: Option<RulingView>,
    /// Its stage is blind: its result is hidden until the organiser opens that; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Everybody sees it and its dataset, without a token.
    pub public: bool,
    /// Its dataset was removed, if it was: when, and by which retention; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset_removed: Option<RulingView>,
    /// The perturbations.
    pub profile: Profile,
    /// In the order of play.
    pub tasks: Vec<Task>,
    /// Episodes of each task.
    pub episodes_per_task: u32,
    /// When it was queued.
    pub created_at: Timestamp,
    /// How far it is.
    pub progress: Progress,
    /// Where it stands in the queue; absent once it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next.
    pub next: String,
    /// What has become of it.
    #[serde(flatten)]
    pub status: EvaluationStatus,
}

/// How much of an evaluation or of an ablation is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Episodes played.
    pub episodes_done: u32,
    /// Episodes to play, over all tasks (and profiles).
    pub episodes_total: u32,
}
