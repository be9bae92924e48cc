//! Trials and proposed re-evaluations: evaluations that do not count, and the changes that they would make.

use crate::views::{
    board::BoardView,
    evaluation::{FaultView, Progress, ResultView},
};
use faceoff_types::{
    EvaluationId, ProposalId, StageId, StageName, SubmissionId, TeamId, TeamName, Tier,
    deprecated_names,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A trial, or a proposed re-evaluation: evaluations of a stage that do not count unless they are applied. Only
/// organisers see them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct ProposalView {
    /// Id of the proposal.
    pub id: ProposalId,
    /// The stage whose rules apply.
    pub stage: StageId,
    /// Name of the stage.
    pub stage_name: StageName,
    /// Revision of the stage's rules.
    pub revision: u32,
    /// What it evaluates.
    pub kind: ProposalKindView,
    /// The day whose results it would change; null for a trial.
    pub day: Option<Date>,
    /// The organiser's reason.
    pub reason: String,
    /// When it was queued.
    pub created_at: Timestamp,
    /// Its progress or outcome.
    pub state: ProposalStateView,
    /// When it was applied or dropped; null before.
    pub decided_at: Option<Timestamp>,
    /// Its evaluations, in the order in which they were queued; absent in lists.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub evaluations: Vec<ProposedEvaluationView>,
    /// What applying it would change; for a trial, how its agents compare. Present only while all evaluations have
    /// ended and it is neither applied nor dropped; absent in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<OutcomeView>,
}
deprecated_names!(ProposalView { settled_at => decided_at });

/// Kind of a proposal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProposalKindView {
    /// Active submissions on episodes of the trial's own; never counts.
    Trial,
    /// One evaluation, repeated on the same episodes.
    Evaluation,
    /// All evaluations of a day that count, repeated on the same episodes.
    Day,
    /// All evaluations of a day that count, repeated under the stage's newest rules, for the board of these.
    Rules,
}

/// State of a proposal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProposalStateView {
    /// Evaluations are pending or running.
    #[serde(rename = "playing")]
    Running,
    /// All evaluations have ended; an organiser applies or drops the proposal.
    #[serde(rename = "played")]
    Finished,
    /// Its evaluations count.
    Applied,
    /// Its evaluations never count.
    Dropped,
}

/// Boards before and after a proposal is applied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OutcomeView {
    /// Teams whose rank, tier, score or points change, in the order of the new board; empty for a trial.
    pub changes: Vec<ChangeView>,
    /// The current board; null for a trial.
    pub old_board: Option<BoardView>,
    /// The board after the proposal is applied; for a trial, a board of its results only.
    pub new_board: BoardView,
}

/// How a team's rank and score change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChangeView {
    /// Name of the team.
    pub team: TeamName,
    /// On the current board; null if the team has no row.
    pub old: Option<RankView>,
    /// On the new board; null if the team has no row.
    pub new: Option<RankView>,
}

/// Rank and score of a team.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RankView {
    /// From 1.
    pub rank: u32,
    /// Overall tier; absent in a competition without tiers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub tier: Option<Tier>,
    /// Overall score in percent.
    pub score: f64,
    /// Overall penalty points.
    pub penalty_points: f64,
}

/// An evaluation of a trial or a proposal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ProposedEvaluationView {
    /// Id of the evaluation, which it keeps if it is applied.
    pub evaluation: EvaluationId,
    /// Id of the team.
    pub team: TeamId,
    /// Name of the team.
    pub team_name: TeamName,
    /// The evaluated submission.
    pub submission: SubmissionId,
    /// The evaluation that it repeats; null in a trial.
    pub replaces: Option<EvaluationId>,
    /// Episodes done and in total.
    pub progress: Progress,
    /// Its state, with the result or the reason of its failure.
    #[serde(flatten)]
    pub status: ProposedEvaluationStatus,
}

/// State of an evaluation that does not count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum ProposedEvaluationStatus {
    /// Waiting behind evaluations that count.
    Queued,
    /// Episodes are running.
    Running,
    /// The score is being computed.
    #[serde(rename = "finalising")]
    Scoring,
    /// It has a score.
    Finished {
        /// When the score was stored.
        finished_at: Timestamp,
        /// The complete result.
        result: Box<ResultView>,
        /// Path of the recorded dataset on this server, for organisers only until it is applied; absent once it is
        /// dropped.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset: Option<String>,
        /// BLAKE3 hash of the dataset file, 64 hexadecimal digits; absent once it is dropped.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        dataset_blake3: Option<String>,
    },
    /// The agent violated the protocol or exceeded a limit too often. If it is applied, the team has no score.
    AgentFailed {
        /// When the last fault was stored.
        finished_at: Timestamp,
        /// The agent's faults.
        faults: Vec<FaultView>,
    },
    /// A platform fault. If it is applied, the earlier result stays.
    PlatformFailed {
        /// When the evaluation was given up.
        finished_at: Timestamp,
        /// What failed.
        reason: String,
    },
    /// Its proposal was dropped before it ended.
    Cancelled {
        /// When it was cancelled.
        finished_at: Timestamp,
    },
}
