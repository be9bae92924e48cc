//! Trials and re-evaluations: made, looked at, applied or dropped by the organiser, and seen by nobody else.

use super::recorded::Recorded;
use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{Confirmation, NewProposal, Trial},
    views::proposal::{ProposalStateView, ProposalView},
};
use faceoff_service::{
    acts::deciding::checked_reason,
    app::App,
    auth::Organiser,
    extract::{Json as Body, OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::proposal,
};
use faceoff_store::{EvaluationState, Reevaluation, Settled, StoreError};
use faceoff_types::{EvaluationId, ProposalId, StageDay, StageId};

/// All trials and proposals, the newest first, without what they play.
#[utoipa::path(
    get, path = "/proposals", tag = "organiser", security(("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<ProposalView>))
)]
pub(crate) async fn list_proposals(
    _: Organiser,
    page: Page<ProposalId>,
    State(app): State<App>,
) -> Result<Paged<ProposalView>, Problem> {
    let page = page.cut(app.store.proposals().await?, |proposal| proposal.id)?;
    page.seen(async |proposals| proposal::heads(&app, proposals).await)
        .await
}

/// One, with what it plays; once all of it is played, the board as it is and as it would be, and whose rank or score
/// would change.
#[utoipa::path(
    get, path = "/proposals/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = ProposalId, Path)),
    responses((status = 200, body = ProposalView), (status = 404))
)]
pub(crate) async fn proposal(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<ProposalId>,
) -> Result<Json<ProposalView>, Problem> {
    proposal::find(&app, id).await.map(Json)
}

/// Plays what is active, or one submission, by the stage's rules on episodes that nothing else plays: no turn, no
/// board, behind everything that counts.
#[utoipa::path(
    post, path = "/stages/{id}/trial", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = Trial,
    responses(
        (status = 201, body = ProposalView),
        (status = 404),
        (status = 409, description = "there is nothing valid to play, the stage has closed, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_trial(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(Trial { submission, reason }): Body<Trial>,
) -> Result<(StatusCode, Json<ProposalView>), Problem> {
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    let trial = app
        .store
        .propose_trial(organiser.actor(), id, submission, reason, now)
        .await?;
    tracing::info!(proposal = %trial.id, stage = %id, reason, "a trial was started");
    let view = proposal::find(&app, trial.id).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Plays results that count once more, beside them: one evaluation, a whole day, or a day by the stage's newest
/// rules. Nothing changes before it is applied.
#[utoipa::path(
    post, path = "/stages/{id}/proposals", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = NewProposal,
    responses(
        (status = 201, body = ProposalView),
        (status = 404),
        (status = 409, description = "nothing of it counts, its day is under way, there are no other rules, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn propose(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(wanted): Body<NewProposal>,
) -> Result<(StatusCode, Json<ProposalView>), Problem> {
    let reason = checked_reason(&wanted.reason)?;
    let of = |date| StageDay { stage: id, date };
    let what = match (wanted.evaluation, wanted.day, wanted.new_rules) {
        (Some(evaluation), None, false) => {
            if app.store.evaluation(evaluation).await?.of.stage != id {
                return Err(Problem::not_found("evaluation in this stage"));
            }
            Reevaluation::Evaluation(evaluation)
        }
        (None, Some(day), false) => Reevaluation::Day(of(day)),
        (None, Some(day), true) => Reevaluation::Rules(of(day)),
        (Some(_), _, true) => {
            let detail =
                "other rules are for a whole day: name the “day”, and leave out “evaluation”";
            return Err(Problem::invalid("new_rules", detail));
        }
        _ => {
            let detail = "expected either “evaluation” or “day”, what is to be played again";
            return Err(Problem::invalid("day", detail));
        }
    };
    app.store.stage(id).await?;
    let now = app.config.clock.now();
    let proposal = app
        .store
        .propose_reevaluation(organiser.actor(), what, reason, now)
        .await?;
    tracing::info!(proposal = %proposal.id, stage = %id, reason, "a re-evaluation was proposed");
    let view = proposal::find(&app, proposal.id).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Has what a proposal has played count: what it played again is voided, with its reason, unless it is by other rules.
#[utoipa::path(
    post, path = "/proposals/{id}/apply", tag = "organiser", security(("organiser" = [])),
    params(("id" = ProposalId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = ProposalView),
        (status = 404),
        (status = 409, description = "not confirmed with the date (nothing is done), a trial, not played to its end, settled, the boards are frozen, or what it would replace counts no more"),
    )
)]
pub(crate) async fn apply_proposal(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<ProposalId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<ProposalView>, Problem> {
    let view = proposal::find(&app, id).await?;
    if let (Some(day), ProposalStateView::Played, Some(outcome)) =
        (view.day, view.state, &view.outcome)
    {
        let ranks = outcome.changes.iter().filter(|change| {
            change.old.map(|standing| standing.rank) != change.new.map(|standing| standing.rank)
        });
        let what = format!(
            "{} evaluations of {day} would count from now on in the place of those that they play again, {} teams would \
             have another row and {} another rank, and everybody would read {:?}",
            view.evaluations.len(),
            outcome.changes.len(),
            ranks.count(),
            view.reason
        );
        Problem::check_confirmed(confirm.as_deref(), &day.to_string(), &what)?;
    }
    let now = app.config.clock.now();
    app.store.apply_proposal(organiser.actor(), id, now).await?;
    tracing::info!(proposal = %id, "a proposal was applied");
    proposal::find(&app, id).await.map(Json)
}

/// Has what a trial or a proposal has played never count; what is under way of it is stopped.
#[utoipa::path(
    post, path = "/proposals/{id}/drop", tag = "organiser", security(("organiser" = [])),
    params(("id" = ProposalId, Path)),
    request_body(content = Option<Confirmation>, content_type = "application/json"),
    responses(
        (status = 200, body = ProposalView),
        (status = 404),
        (status = 409, description = "not confirmed with the stage's name (nothing is done), or it is settled"),
    )
)]
pub(crate) async fn drop_proposal(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<ProposalId>,
    OptionalJson(Confirmation { confirm }): OptionalJson<Confirmation>,
) -> Result<Json<ProposalView>, Problem> {
    let view = proposal::find(&app, id).await?;
    if view.settled_at.is_none() {
        let what = format!(
            "{} evaluations would never count, what is under way of them be stopped, and their datasets be removed",
            view.evaluations.len()
        );
        Problem::check_confirmed(confirm.as_deref(), view.stage_name.as_str(), &what)?;
    }
    let now = app.config.clock.now();
    app.store.drop_proposal(organiser.actor(), id, now).await?;
    tracing::info!(proposal = %id, "a proposal was dropped");
    proposal::find(&app, id).await.map(Json)
}

/// The dataset of what a trial or a proposal has played, that is not applied. `None` of what it is not, and for
/// everybody but organisers.
///
/// # Errors
/// `Gone` once it is dropped; `Conflict` if it has no dataset.
pub(super) async fn dataset(
    viewer: Viewer,
    app: &App,
    id: EvaluationId,
) -> Result<Option<Recorded>, Problem> {
    if viewer != Viewer::Organiser {
        return Ok(None);
    }
    let (proposal, draft) = match app.store.draft(id).await {
        Ok(found) => found,
        Err(StoreError::NotFound(_)) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    match proposal.settled {
        // It is an evaluation like others.
        Some(Settled::Applied(_)) => return Ok(None),
        Some(Settled::Dropped(at)) => {
            return Err(Problem::new(
                ProblemKind::Gone,
                format!(
                    "the proposal {} was dropped at {at}, and its datasets with it; GET /api/v1/proposals/{} still tells \
                     what came of it",
                    proposal.id, proposal.id
                ),
            ));
        }
        None => {}
    }
    let why_not = match draft.state {
        EvaluationState::Finished {
            dataset,
            dataset_blake3,
            ..
        } => {
            let day = match proposal.kind.day() {
                Some(day) => day,
                None => {
                    let stage = app.store.stage(proposal.stage).await?;
                    stage.day(proposal.created_at).date
                }
            };
            return Ok(Some(Recorded {
                team: draft.team,
                day,
                dataset,
                blake3: dataset_blake3,
            }));
        }
        EvaluationState::Queued | EvaluationState::Running { .. } | EvaluationState::Finalising => {
            "is not finished; follow it there until its state is “finished”"
        }
        EvaluationState::AgentFailed { .. } => {
            "has no dataset, since the agent failed too often; its faults are there"
        }
        EvaluationState::PlatformFailed { .. }
        | EvaluationState::NotPlayed { .. }
        | EvaluationState::Cancelled { .. } => {
            "has no dataset, since it was not played to its end; the reason is there"
        }
    };
    Err(Problem::new(
        ProblemKind::Conflict,
        format!(
            "the evaluation {id} of GET /api/v1/proposals/{} {why_not}",
            proposal.id
        ),
    ))
}
