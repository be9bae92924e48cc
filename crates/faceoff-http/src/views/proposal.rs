//! What is tried without counting, and what a re-evaluation would change.

use super::{
    board::{BoardView, Whose},
    evaluation::{FaultView, Progress, ResultView},
    shown,
    sight::Sight,
};
use crate::{app::AppState, paths, problem::Problem};
use faceoff_store::{
    BoardRecord, BoardScope, Draft, EvaluationState, Proposal, ProposalKind, Settled, Stage,
};
use faceoff_types::{
    EvaluationId, ProposalId, StageId, StageName, SubmissionId, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
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

impl DraftView {
    async fn of(app: &AppState, draft: Draft, is_dropped: bool) -> Result<Self, Problem> {
        let (mut done, mut total) = (0, 0);
        if let EvaluationState::Running {
            episodes_done,
            episodes_total,
        } = &draft.state
        {
            (done, total) = (*episodes_done, *episodes_total);
        }
        let status = match draft.state {
            EvaluationState::Queued => DraftStatus::Queued,
            EvaluationState::Running { .. } => DraftStatus::Running,
            EvaluationState::Finalising => DraftStatus::Finalising,
            EvaluationState::Finished {
                finished_at,
                result,
                dataset_blake3,
                ..
            } => DraftStatus::Finished {
                finished_at,
                result: Box::new(ResultView::new(*result, true)),
                dataset: (!is_dropped).then(|| format!("{}/dataset", paths::evaluation(draft.id))),
                dataset_blake3: dataset_blake3.filter(|_| !is_dropped),
            },
            EvaluationState::AgentFailed { finished_at } => {
                let of_run = app.store.run_faults(draft.run).await?;
                DraftStatus::AgentFailed {
                    finished_at,
                    faults: of_run.faults.into_iter().map(FaultView::from).collect(),
                }
            }
            EvaluationState::PlatformFailed {
                finished_at,
                reason,
            } => DraftStatus::PlatformFailed {
                finished_at,
                reason: shown(reason),
            },
            EvaluationState::NotPlayed { finished_at, .. }
            | EvaluationState::Cancelled { finished_at, .. } => {
                DraftStatus::Cancelled { finished_at }
            }
        };
        Ok(Self {
            evaluation: draft.id,
            team: draft.team,
            team_name: app.store.team(draft.team).await?.name,
            submission: draft.submission,
            replaces: draft.replaces,
            progress: Progress {
                episodes_done: done,
                episodes_total: total,
            },
            status,
        })
    }
}

/// The row that a draft with a score would be.
async fn record(
    app: &AppState,
    stage: &Stage,
    proposal: &Proposal,
    draft: &Draft,
) -> Result<Option<BoardRecord>, Problem> {
    let EvaluationState::Finished {
        finished_at,
        result,
        ..
    } = &draft.state
    else {
        return Ok(None);
    };
    let team = app.store.team(draft.team).await?;
    if team.disqualified.is_some() {
        return Ok(None);
    }
    let submission = app.store.submission(draft.submission).await?;
    let (released_at, extra_for) = match draft.replaces {
        Some(id) => {
            let replaced = app.store.evaluation(id).await?;
            (replaced.released_at, replaced.extra_for)
        }
        None => (None, None),
    };
    let day = proposal.kind.day();
    Ok(Some(BoardRecord {
        team,
        submission: submission.id,
        submitted_at: submission.created_at,
        agent_name: submission.agent_name,
        evaluation: draft.id,
        run: draft.run,
        day: day.unwrap_or_else(|| stage.day(proposal.created_at).date),
        released_at,
        extra_for,
        finished_at: *finished_at,
        result: (**result).clone(),
    }))
}

impl OutcomeView {
    async fn of(app: &AppState, proposal: &Proposal, drafts: &[Draft]) -> Result<Self, Problem> {
        let stage = app.store.stage(proposal.stage).await?;
        let sight = Sight::of_organiser(app).await?;
        let mut played = Vec::new();
        for draft in drafts {
            played.extend(record(app, &stage, proposal, draft).await?);
        }
        let revision = proposal.revision;
        let old_revision = match proposal.kind {
            ProposalKind::Trial => {
                // Nothing that counts.
                let nothing = BoardScope {
                    until: Some(Timestamp::MIN),
                    ..BoardScope::default()
                };
                let tried = (&nothing, played);
                let new_board =
                    BoardView::of(app, &sight, &stage, revision, Whose::default(), tried).await?;
                return Ok(Self {
                    changes: Vec::new(),
                    old_board: None,
                    new_board,
                });
            }
            ProposalKind::Rules(_) => app.store.board_revision(&stage).await?,
            ProposalKind::Evaluation(_) | ProposalKind::Day(_) => revision,
        };
        let now = (&BoardScope::default(), Vec::new());
        let old_board =
            BoardView::of(app, &sight, &stage, old_revision, Whose::default(), now).await?;
        // What we broke replaces nothing.
        let replaces = |draft: &Draft| match draft.state {
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => {
                draft.replaces
            }
            _ => None,
        };
        let scope = BoardScope {
            without: drafts.iter().filter_map(replaces).collect(),
            ..BoardScope::default()
        };
        let then = (&scope, played);
        let new_board =
            BoardView::of(app, &sight, &stage, revision, Whose::default(), then).await?;
        Ok(Self {
            changes: changes(&old_board, &new_board),
            old_board: Some(old_board),
            new_board,
        })
    }
}

/// Whose rank, tier, score or points differ, in the order of the new board, then of the old one.
fn changes(old: &BoardView, new: &BoardView) -> Vec<ChangeView> {
    let standing = |board: &BoardView, team: TeamId| {
        let ranked = board.rows.iter().find(|row| row.team_id == team);
        let ranked = ranked.map(|row| StandingView {
            rank: row.rank,
            tier: row.tier,
            score: row.score,
            penalty_points: row.penalty_points,
        });
        // A baseline stands where it would.
        ranked.or_else(|| {
            let row = board.baselines.iter().find(|row| row.team_id == team)?;
            Some(StandingView {
                rank: row.would_rank,
                tier: row.tier,
                score: row.score,
                penalty_points: row.penalty_points,
            })
        })
    };
    let mut seen = BTreeSet::new();
    let boards = [new, old].into_iter();
    let teams = boards.flat_map(|board| {
        let ranked = board.rows.iter().map(|row| (row.team_id, &row.team));
        let baselines = board.baselines.iter().map(|row| (row.team_id, &row.team));
        ranked.chain(baselines)
    });
    teams
        .filter(|(id, _)| seen.insert(*id))
        .map(|(id, team)| ChangeView {
            team: team.clone(),
            old: standing(old, id),
            new: standing(new, id),
        })
        .filter(|change| change.old != change.new)
        .collect()
}

impl ProposalView {
    /// These, in their order, without what they play.
    pub(crate) async fn heads(
        app: &AppState,
        proposals: Vec<Proposal>,
    ) -> Result<Vec<Self>, Problem> {
        let mut views = Vec::new();
        for proposal in proposals {
            let (proposal, drafts) = app.store.proposal(proposal.id).await?;
            views.push(Self::head(app, &proposal, &drafts).await?);
        }
        Ok(views)
    }

    /// One, with what it plays and, if that is to be decided, what it would change.
    pub(crate) async fn find(app: &AppState, id: ProposalId) -> Result<Self, Problem> {
        let (proposal, drafts) = app.store.proposal(id).await?;
        let head = Self::head(app, &proposal, &drafts).await?;
        let outcome = match head.state {
            ProposalStateView::Played => Some(OutcomeView::of(app, &proposal, &drafts).await?),
            _ => None,
        };
        let is_dropped = matches!(proposal.settled, Some(Settled::Dropped(_)));
        let mut evaluations = Vec::new();
        for draft in drafts {
            evaluations.push(DraftView::of(app, draft, is_dropped).await?);
        }
        Ok(Self {
            evaluations,
            outcome,
            ..head
        })
    }

    async fn head(app: &AppState, proposal: &Proposal, drafts: &[Draft]) -> Result<Self, Problem> {
        let stage = app.store.stage(proposal.stage).await?;
        let is_over = drafts.iter().all(|draft| draft.state.is_over());
        let (state, settled_at) = match proposal.settled {
            Some(Settled::Applied(at)) => (ProposalStateView::Applied, Some(at)),
            Some(Settled::Dropped(at)) => (ProposalStateView::Dropped, Some(at)),
            None if is_over => (ProposalStateView::Played, None),
            None => (ProposalStateView::Playing, None),
        };
        Ok(Self {
            id: proposal.id,
            stage: stage.id,
            stage_name: stage.name,
            revision: proposal.revision,
            kind: match proposal.kind {
                ProposalKind::Trial => ProposalKindView::Trial,
                ProposalKind::Evaluation(_) => ProposalKindView::Evaluation,
                ProposalKind::Day(_) => ProposalKindView::Day,
                ProposalKind::Rules(_) => ProposalKindView::Rules,
            },
            day: proposal.kind.day(),
            reason: proposal.reason.clone(),
            created_at: proposal.created_at,
            state,
            settled_at,
            evaluations: Vec::new(),
            outcome: None,
        })
    }
}
