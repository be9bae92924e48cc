//! What is tried without counting, and what a re-evaluation would change.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{
        board::{self, Whose},
        sight::Sight,
    },
};
use faceoff_api::{
    paths,
    views::{
        board::BoardView,
        evaluation::{FaultView, Progress, ResultView},
        proposal::{
            ChangeView, DraftStatus, DraftView, OutcomeView, ProposalKindView, ProposalStateView,
            ProposalView, StandingView,
        },
        shown,
    },
};
use faceoff_store::{
    BoardRecord, BoardScope, Draft, EvaluationState, Proposal, ProposalKind, Settled, Stage,
};
use faceoff_types::{ProposalId, TeamId};
use jiff::Timestamp;
use std::collections::BTreeSet;

async fn draft(app: &AppState, draft: Draft, is_dropped: bool) -> Result<DraftView, Problem> {
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
        | EvaluationState::Cancelled { finished_at, .. } => DraftStatus::Cancelled { finished_at },
    };
    Ok(DraftView {
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

async fn outcome(
    app: &AppState,
    proposal: &Proposal,
    drafts: &[Draft],
) -> Result<OutcomeView, Problem> {
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
                board::of(app, &sight, &stage, revision, Whose::default(), tried).await?;
            return Ok(OutcomeView {
                changes: Vec::new(),
                old_board: None,
                new_board,
            });
        }
        ProposalKind::Rules(_) => app.store.board_revision(&stage).await?,
        ProposalKind::Evaluation(_) | ProposalKind::Day(_) => revision,
    };
    let now = (&BoardScope::default(), Vec::new());
    let old_board = board::of(app, &sight, &stage, old_revision, Whose::default(), now).await?;
    // What we broke replaces nothing.
    let replaces = |draft: &Draft| match draft.state {
        EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => draft.replaces,
        _ => None,
    };
    let scope = BoardScope {
        without: drafts.iter().filter_map(replaces).collect(),
        ..BoardScope::default()
    };
    let then = (&scope, played);
    let new_board = board::of(app, &sight, &stage, revision, Whose::default(), then).await?;
    Ok(OutcomeView {
        changes: changes(&old_board, &new_board),
        old_board: Some(old_board),
        new_board,
    })
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

/// These, in their order, without what they play.
#[boxed]
pub async fn heads(app: &AppState, proposals: Vec<Proposal>) -> Result<Vec<ProposalView>, Problem> {
    let mut views = Vec::new();
    for proposal in proposals {
        let (proposal, drafts) = app.store.proposal(proposal.id).await?;
        views.push(head(app, &proposal, &drafts).await?);
    }
    Ok(views)
}

/// One, with what it plays and, if that is to be decided, what it would change.
#[boxed]
pub async fn find(app: &AppState, id: ProposalId) -> Result<ProposalView, Problem> {
    let (proposal, drafts) = app.store.proposal(id).await?;
    let head = head(app, &proposal, &drafts).await?;
    let outcome = match head.state {
        ProposalStateView::Played => Some(outcome(app, &proposal, &drafts).await?),
        _ => None,
    };
    let is_dropped = matches!(proposal.settled, Some(Settled::Dropped(_)));
    let mut evaluations = Vec::new();
    for one in drafts {
        evaluations.push(draft(app, one, is_dropped).await?);
    }
    Ok(ProposalView {
        evaluations,
        outcome,
        ..head
    })
}

async fn head(
    app: &AppState,
    proposal: &Proposal,
    drafts: &[Draft],
) -> Result<ProposalView, Problem> {
    let stage = app.store.stage(proposal.stage).await?;
    let is_over = drafts.iter().all(|draft| draft.state.is_over());
    let (state, settled_at) = match proposal.settled {
        Some(Settled::Applied(at)) => (ProposalStateView::Applied, Some(at)),
        Some(Settled::Dropped(at)) => (ProposalStateView::Dropped, Some(at)),
        None if is_over => (ProposalStateView::Played, None),
        None => (ProposalStateView::Playing, None),
    };
    Ok(ProposalView {
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
