//! Proposals: sets of evaluations that do not count yet. A *trial* runs the active submissions on
//! separate episodes and never counts. A proposed re-evaluation repeats an evaluation, a day, or a day under changed rules. The
//! organisers see how it would change the board, and then apply or drop it.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{
        board::{self, BoardSelection},
        evaluation::used_public_episodes,
        visibility::Visibility,
    },
};
use faceoff_api::{
    paths,
    views::{
        board::BoardView,
        evaluation::{FaultView, Progress, ResultView},
        printable,
        proposal::{
            ChangeView, OutcomeView, ProposalKindView, ProposalStateView, ProposalView,
            ProposedEvaluationStatus, ProposedEvaluationView, RankView,
        },
    },
};
use faceoff_store::{
    BoardRecord, BoardScope, EvaluationState, Proposal, ProposalKind, ProposalOutcome,
    ProposedEvaluation, Stage,
};
use faceoff_types::{ProposalId, TeamId};
use jiff::Timestamp;
use std::collections::BTreeSet;

/// `is_dropped`: the organisers have dropped the proposal, so its datasets are no longer offered.
async fn evaluation_view(
    app: &AppState,
    evaluation: ProposedEvaluation,
    is_dropped: bool,
) -> Result<ProposedEvaluationView, Problem> {
    let mut progress = Progress {
        episodes_done: 0,
        episodes_total: 0,
    };
    if let EvaluationState::Running {
        progress: run,
        episodes_total,
    } = &evaluation.state
    {
        progress = Progress {
            episodes_done: run.episodes_done.min(*episodes_total),
            episodes_total: *episodes_total,
        };
    }
    let status = match evaluation.state {
        EvaluationState::Queued => ProposedEvaluationStatus::Queued,
        EvaluationState::Running { .. } => ProposedEvaluationStatus::Running,
        EvaluationState::Scoring => ProposedEvaluationStatus::Scoring,
        EvaluationState::Finished {
            finished_at,
            result,
            dataset_blake3,
            ..
        } => ProposedEvaluationStatus::Finished {
            finished_at,
            result: Box::new(ResultView::new(*result, true)),
            dataset: (!is_dropped).then(|| format!("{}/dataset", paths::evaluation(evaluation.id))),
            dataset_blake3: dataset_blake3.filter(|_| !is_dropped),
        },
        EvaluationState::AgentFailed { finished_at } => {
            let run_faults = app.store.run_faults(evaluation.run).await?;
            ProposedEvaluationStatus::AgentFailed {
                finished_at,
                faults: run_faults.faults.into_iter().map(FaultView::from).collect(),
            }
        }
        EvaluationState::PlatformFailed {
            finished_at,
            reason,
        } => ProposedEvaluationStatus::PlatformFailed {
            finished_at,
            reason: printable(reason),
        },
        EvaluationState::DeadlineMissed { finished_at, .. }
        | EvaluationState::Cancelled { finished_at, .. } => {
            ProposedEvaluationStatus::Cancelled { finished_at }
        }
    };
    Ok(ProposedEvaluationView {
        evaluation: evaluation.id,
        team: evaluation.team,
        team_name: app.store.team(evaluation.team).await?.name,
        submission: evaluation.submission,
        replaces: evaluation.replaces,
        progress,
        status,
    })
}

/// The board record of a proposed evaluation; `None` if it has no score, or its team is disqualified.
async fn board_record(
    app: &AppState,
    stage: &Stage,
    proposal: &Proposal,
    evaluation: &ProposedEvaluation,
) -> Result<Option<BoardRecord>, Problem> {
    let EvaluationState::Finished {
        finished_at,
        result,
        ..
    } = &evaluation.state
    else {
        return Ok(None);
    };
    let team = app.store.team(evaluation.team).await?;
    if team.disqualified.is_some() {
        return Ok(None);
    }
    let submission = app.store.submission(evaluation.submission).await?;
    let (released_at, extra_reason) = match evaluation.replaces {
        Some(id) => {
            let replaced = app.store.evaluation(id).await?;
            (replaced.released_at, replaced.extra_reason)
        }
        None => (None, None),
    };
    let day = proposal.kind.day();
    Ok(Some(BoardRecord {
        team,
        submission: submission.id,
        submitted_at: submission.created_at,
        agent_name: submission.agent_name,
        evaluation: evaluation.id,
        run: evaluation.run,
        day: day.unwrap_or_else(|| stage.day(proposal.created_at).date),
        released_at,
        rerun_after_release: used_public_episodes(
            evaluation.created_at,
            released_at,
            extra_reason.as_deref(),
        ),
        extra_reason,
        finished_at: *finished_at,
        result: (**result).clone(),
    }))
}

/// The boards without and with the proposed results, and the differences.
async fn board_effect(
    app: &AppState,
    proposal: &Proposal,
    proposed: &[ProposedEvaluation],
) -> Result<OutcomeView, Problem> {
    let stage = app.store.stage(proposal.stage).await?;
    let visibility = Visibility::for_organiser(app).await?;
    let mut proposed_records = Vec::new();
    for evaluation in proposed {
        proposed_records.extend(board_record(app, &stage, proposal, evaluation).await?);
    }
    let build_board = async |revision: u32, scope: &BoardScope, extra: Vec<BoardRecord>| {
        let selection = BoardSelection::default();
        board::build(
            app,
            &visibility,
            &stage,
            revision,
            selection,
            (scope, extra),
        )
        .await
    };
    let revision = proposal.revision;
    let old_revision = match proposal.kind {
        ProposalKind::Trial => {
            // The board of a trial shows only the results of the trial.
            let empty_scope = BoardScope {
                finished_until: Some(Timestamp::MIN),
                ..BoardScope::default()
            };
            return Ok(OutcomeView {
                changes: Vec::new(),
                old_board: None,
                new_board: build_board(revision, &empty_scope, proposed_records).await?,
            });
        }
        ProposalKind::DayWithNewestRules(_) => app.store.board_revision(&stage).await?,
        ProposalKind::Evaluation(_) | ProposalKind::Day(_) => revision,
    };
    let old_board = build_board(old_revision, &BoardScope::default(), Vec::new()).await?;
    // An evaluation that failed by a platform fault replaces no result.
    let replaced_evaluation = |evaluation: &ProposedEvaluation| match evaluation.state {
        EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => {
            evaluation.replaces
        }
        _ => None,
    };
    let scope = BoardScope {
        excluded: proposed.iter().filter_map(replaced_evaluation).collect(),
        ..BoardScope::default()
    };
    let new_board = build_board(revision, &scope, proposed_records).await?;
    Ok(OutcomeView {
        changes: changes(&old_board, &new_board),
        old_board: Some(old_board),
        new_board,
    })
}

/// Teams whose rank, tier, score or points differ, in the order of the new board, then of the old one.
fn changes(old: &BoardView, new: &BoardView) -> Vec<ChangeView> {
    let rank = |board: &BoardView, team: TeamId| {
        let ranked = board.rows.iter().find(|row| row.team_id == team);
        let ranked = ranked.map(|row| RankView {
            rank: row.rank,
            tier: row.tier,
            score: row.score,
            penalty_points: row.penalty_points,
        });
        // A baseline has the rank that it would have as a team.
        ranked.or_else(|| {
            let row = board.baselines.iter().find(|row| row.team_id == team)?;
            Some(RankView {
                rank: row.hypothetical_rank,
                tier: row.tier,
                score: row.score,
                penalty_points: row.penalty_points,
            })
        })
    };
    let mut seen_teams = BTreeSet::new();
    let boards = [new, old].into_iter();
    let teams = boards.flat_map(|board| {
        let ranked = board.rows.iter().map(|row| (row.team_id, &row.team));
        let baselines = board.baselines.iter().map(|row| (row.team_id, &row.team));
        ranked.chain(baselines)
    });
    teams
        .filter(|(id, _)| seen_teams.insert(*id))
        .map(|(id, team)| ChangeView {
            team: team.clone(),
            old: rank(old, id),
            new: rank(new, id),
        })
        .filter(|change| change.old != change.new)
        .collect()
}

/// The proposals, in order, without their evaluations and outcomes.
#[boxed_future]
pub async fn list(app: &AppState, proposals: Vec<Proposal>) -> Result<Vec<ProposalView>, Problem> {
    let mut views = Vec::new();
    for proposal in proposals {
        let (proposal, proposed) = app.store.proposal(proposal.id).await?;
        views.push(summary(app, &proposal, &proposed).await?);
    }
    Ok(views)
}

/// A proposal with its evaluations and, once it can be decided, the changes that it would make.
#[boxed_future]
pub async fn find(app: &AppState, id: ProposalId) -> Result<ProposalView, Problem> {
    let (proposal, proposed) = app.store.proposal(id).await?;
    let summary = summary(app, &proposal, &proposed).await?;
    let board_effect = match summary.state {
        ProposalStateView::Finished => Some(board_effect(app, &proposal, &proposed).await?),
        _ => None,
    };
    let is_dropped = matches!(proposal.outcome, Some(ProposalOutcome::Dropped(_)));
    let mut evaluations = Vec::new();
    for evaluation in proposed {
        evaluations.push(evaluation_view(app, evaluation, is_dropped).await?);
    }
    Ok(ProposalView {
        evaluations,
        outcome: board_effect,
        ..summary
    })
}

/// A proposal without its evaluations and its outcome.
async fn summary(
    app: &AppState,
    proposal: &Proposal,
    proposed: &[ProposedEvaluation],
) -> Result<ProposalView, Problem> {
    let stage = app.store.stage(proposal.stage).await?;
    let is_over = proposed.iter().all(|evaluation| evaluation.state.is_over());
    let (state, decided_at) = match proposal.outcome {
        Some(ProposalOutcome::Applied(at)) => (ProposalStateView::Applied, Some(at)),
        Some(ProposalOutcome::Dropped(at)) => (ProposalStateView::Dropped, Some(at)),
        None if is_over => (ProposalStateView::Finished, None),
        None => (ProposalStateView::Running, None),
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
            ProposalKind::DayWithNewestRules(_) => ProposalKindView::Rules,
        },
        day: proposal.kind.day(),
        reason: proposal.reason.clone(),
        created_at: proposal.created_at,
        state,
        decided_at,
        evaluations: Vec::new(),
        outcome: None,
    })
}
