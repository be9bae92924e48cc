//! What is tried without counting, and what a re-evaluation would change.

use crate::views::{
    board::BoardView,
    evaluation::{FaultView, Progress, ResultView},
};
use faceoff_types::{
    EvaluationId, ProposalId, StageId, StageName, SubmissionId, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Evaluations of a stage that do not count: a trial, or a re-evaluation until it is applied. The organiser alone sees
/// them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ProposalView {
    /// Names the proposal in paths.
    pub id: ProposalId,
    /// Whose rules they are played by.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// By which of the stage's rules.
    pub revision: u32,
    /// What is played.
    pub kind: ProposalKindView,
    /// The date whose results it would change; null of a trial.
    pub day: Option<Date>,
    /// The organiser's words.
    pub reason: String,
    /// When it was queued.
    pub created_at: Timestamp,
    /// How far it is, or what became of it.
    pub state: ProposalStateView,
    /// When it was applied or dropped; null before.
    pub settled_at: Option<Timestamp>,
    /// What is played, in the order in which it was queued; absent in lists.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub evaluations: Vec<DraftView>,
    /// What it would change, or how its agents compare; absent in lists, and unless all of it is played and nothing is
    /// decided yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<OutcomeView>,
}

/// What a proposal plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProposalKindView {
    /// What was active, on episodes of its own; it never counts.
    Trial,
    /// One evaluation, on the same episodes.
    Evaluation,
    /// All of a day that counted, on the same episodes.
    Day,
    /// The same by the stage's newest rules, for the board of these.
    Rules,
}

/// How far a proposal is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProposalStateView {
    /// Something of it waits or is under way.
    Playing,
    /// All of it is over; the organiser applies or drops it.
    Played,
    /// It counts.
    Applied,
    /// It never will.
    Dropped,
}

/// The boards before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OutcomeView {
    /// Whose rank or score would be another, in the order of the new board; none of a trial.
    pub changes: Vec<ChangeView>,
    /// As it is; null of a trial.
    pub old_board: Option<BoardView>,
    /// As it would be; of a trial, that of its results alone.
    pub new_board: BoardView,
}

/// What would change for a team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChangeView {
    /// Whose.
    pub team: TeamName,
    /// As the board is; null if it is not on it.
    pub old: Option<StandingView>,
    /// As it would be; null if it would not be on it.
    pub new: Option<StandingView>,
}

/// Where a team stands on a board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StandingView {
    /// From 1.
    pub rank: u32,
    /// Overall.
    pub tier: Tier,
    /// In percent.
    pub score: f64,
    /// Overall.
    pub penalty_points: f64,
}

/// One evaluation that does not count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DraftView {
    /// The evaluation that it becomes if it is applied.
    pub evaluation: EvaluationId,
    /// Whose it is.
    pub team: TeamId,
    /// As the board shows it.
    pub team_name: TeamName,
    /// What plays.
    pub submission: SubmissionId,
    /// The evaluation that it plays again; null in a trial.
    pub replaces: Option<EvaluationId>,
    /// How far it is.
    pub progress: Progress,
    /// What has become of it.
    #[serde(flatten)]
    pub status: DraftStatus,
}

/// What has become of an evaluation that does not count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum DraftStatus {
    /// It waits behind what counts.
    Queued,
    /// Episodes are being played.
    Running,
    /// The score is being computed.
    Finalising,
    /// It has a score.
    Finished {
        /// When.
        finished_at: Timestamp,
        /// All of it.
        result: Box<ResultView>,
        /// Path of the recorded dataset on this server, for organisers alone until it is applied; absent once it is
        /// dropped.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset: Option<String>,
        /// BLAKE3 of its archive, 64 hexadecimal digits; likewise.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset_blake3: Option<String>,
    },
    /// The agent broke the protocol or a limit too often: applied, it has no score.
    AgentFailed {
        /// When.
        finished_at: Timestamp,
        /// What the agent did.
        faults: Vec<FaultView>,
    },
    /// Our fault: applied, it changes nothing.
    PlatformFailed {
        /// When.
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// It was dropped before its end.
    Cancelled {
        /// When.
        finished_at: Timestamp,
    },
}
