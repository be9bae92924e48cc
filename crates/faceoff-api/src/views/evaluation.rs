//! Evaluations and their progress. An evaluation runs one team's submission over all tasks of an *evaluation day*, whose
//! results are *released* (made public) once all its evaluations have ended.

pub use crate::views::evaluation_status::{EvaluationStatus, FaultView, ResultView};
use crate::views::{decision::DecisionView, queue::QueueView};
use faceoff_types::{
    EvaluationId, Profile, StageId, SubmissionId, Task, TeamId, TeamName, deprecated_names,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An evaluation: one run of a submission over all tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct EvaluationView {
    /// Id of the evaluation.
    pub id: EvaluationId,
    /// The evaluated submission.
    pub submission: SubmissionId,
    /// Id of the submission's team.
    pub team: TeamId,
    /// Name of the team.
    pub team_name: TeamName,
    /// The stage of its day.
    pub stage: StageId,
    /// Revision of the stage's rules.
    pub revision: u32,
    /// The evaluation day, a date in the stage's time zone.
    pub day: Date,
    /// When the day was released, after its last evaluation; null before.
    pub released_at: Option<Timestamp>,
    /// When an unfinished evaluation is ended, unless the day is released before; null: no deadline.
    pub deadline_at: Option<Timestamp>,
    /// The evaluation that it repeats, which was cancelled, voided or failed by a platform fault; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rerun_of: Option<EvaluationId>,
    /// If it is an extra evaluation: the reason for it; absent otherwise. One that was granted after the day's release
    /// runs on other episodes than the day's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_evaluation: Option<String>,
    /// Does it repeat an evaluation of the day at an organiser's request, made after the release, when the day's seed was public?
    /// Absent if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rerun_after_release: bool,
    /// If it was voided and does not count: when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voided: Option<DecisionView>,
    /// True if the result is hidden until the organisers reveal the blind stage; absent otherwise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Whether the evaluation and its dataset are public, readable without a token.
    pub public: bool,
    /// If its dataset was removed: when, and by which retention rule; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset_removed: Option<DecisionView>,
    /// Perturbation profile of the simulator.
    pub profile: Profile,
    /// Tasks in the order in which they run.
    pub tasks: Vec<Task>,
    /// Episodes of each task.
    pub episodes_per_task: u32,
    /// When it was queued.
    pub created_at: Timestamp,
    /// Episodes done and in total.
    pub progress: Progress,
    /// Its position in the queue; absent once it has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens next, in words.
    pub next: String,
    /// Its state, with the result or the reason of its failure.
    #[serde(flatten)]
    pub status: EvaluationStatus,
}
deprecated_names!(EvaluationView { extra_turn => extra_evaluation });

/// Progress of an evaluation or of an ablation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Episodes done.
    pub episodes_done: u32,
    /// Episodes in total, over all tasks (and profiles).
    pub episodes_total: u32,
}
