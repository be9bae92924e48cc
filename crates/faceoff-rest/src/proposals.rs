//! Trials, which never count, and proposed re-evaluations, which count once an organiser applies them. Only organisers see
//! them.

use super::stored_dataset::StoredDataset;
use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{Confirmation, NewProposal, Trial},
    views::proposal::{ProposalStateView, ProposalView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    services::decision_preview::checked_reason,
    viewer::Viewer,
    views::proposal,
};
use faceoff_store::{EvaluationState, ProposalOutcome, Reevaluation, StoreError};
use faceoff_types::{EvaluationId, ProposalId, StageDay, StageId};

/// Lists all trials and proposals, newest first, without their evaluations.
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
    let page = page.select(app.store.proposals().await?, |proposal| proposal.id)?;
    page.map_all(async |proposals| proposal::list(&app, proposals).await)
        .await
}

/// Returns a trial or proposal with its evaluations. Once all have ended, it also contains the board before and after,
/// and the teams whose rank or score would change.
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

/// Starts a trial: evaluates all active submissions, or one submission, by the stage's rules on episodes that no evaluation
/// day uses.
///
/// It never counts, and its jobs run behind all jobs that count.
#[utoipa::path(
    post, path = "/stages/{id}/trial", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = Trial,
    responses(
        (status = 201, body = ProposalView),
        (status = 404),
        (status = 409, description = "there is no valid submission, the stage has closed, or the season is closed"),
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
    tracing::info!(proposal = %trial.id, stage = %id, reason, "trial started");
    let view = proposal::find(&app, trial.id).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Proposes a re-evaluation: repeats one evaluation, a whole day, or a day by the stage's newest rules. Boards do not change
/// until the proposal is applied.
#[utoipa::path(
    post, path = "/stages/{id}/proposals", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = NewProposal,
    responses(
        (status = 201, body = ProposalView),
        (status = 404),
        (status = 409, description = "no such evaluation counts, the day is not released, there are no newer rules, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn propose(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(request): Body<NewProposal>,
) -> Result<(StatusCode, Json<ProposalView>), Problem> {
    let reason = checked_reason(&request.reason)?;
    let stage_day = |date| StageDay { stage: id, date };
    let reevaluation = match (request.evaluation, request.day, request.new_rules) {
        (Some(evaluation), None, false) => {
            if app.store.evaluation(evaluation).await?.stage_day.stage != id {
                return Err(Problem::not_found("evaluation in this stage"));
            }
            Reevaluation::Evaluation(evaluation)
        }
        (None, Some(day), false) => Reevaluation::Day(stage_day(day)),
        (None, Some(day), true) => Reevaluation::DayWithNewestRules(stage_day(day)),
        (Some(_), _, true) => {
            let detail = "expected “day” with new rules, got “evaluation”; name the “day”, and leave out “evaluation”";
            return Err(Problem::invalid("new_rules", detail));
        }
        _ => {
            let detail = "expected exactly one of “evaluation” and “day”; name what to repeat";
            return Err(Problem::invalid("day", detail));
        }
    };
    app.store.stage(id).await?;
    let now = app.config.clock.now();
    let proposal = app
        .store
        .propose_reevaluation(organiser.actor(), reevaluation, reason, now)
        .await?;
    tracing::info!(proposal = %proposal.id, stage = %id, reason, "re-evaluation proposed");
    let view = proposal::find(&app, proposal.id).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Applies a proposal: its evaluations count. The repeated ones are voided with its reason, unless it uses newer rules.
#[utoipa::path(
    post, path = "/proposals/{id}/apply", tag = "organiser", security(("organiser" = [])),
    params(("id" = ProposalId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = ProposalView),
        (status = 404),
        (status = 409, description = "not confirmed with the date (nothing is done), it is a trial, has unfinished evaluations, or is already applied or dropped; the boards are frozen; or an evaluation that it would replace no longer counts"),
    )
)]
pub(crate) async fn apply_proposal(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<ProposalId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<ProposalView>, Problem> {
    let view = proposal::find(&app, id).await?;
    if let (Some(day), ProposalStateView::Finished, Some(outcome)) =
        (view.day, view.state, &view.outcome)
    {
        let rank_changes = outcome
            .changes
            .iter()
            .filter(|change| change.old.map(|old| old.rank) != change.new.map(|new| new.rank));
        let effect = format!(
            "{} evaluations of {day} will replace those that they repeat; {} teams will have another row and {} another rank; \
             the reason {:?} will be public",
            view.evaluations.len(),
            outcome.changes.len(),
            rank_changes.count(),
            view.reason
        );
        Problem::check_confirmed(confirm.as_deref(), &day.to_string(), &effect)?;
    }
    let now = app.config.clock.now();
    app.store.apply_proposal(organiser.actor(), id, now).await?;
    tracing::info!(proposal = %id, "proposal applied");
    proposal::find(&app, id).await.map(Json)
}

/// Drops a trial or proposal: it never counts. Its unfinished evaluations are cancelled, and its datasets removed.
#[utoipa::path(
    post, path = "/proposals/{id}/drop", tag = "organiser", security(("organiser" = [])),
    params(("id" = ProposalId, Path)),
    request_body(content = Option<Confirmation>, content_type = "application/json"),
    responses(
        (status = 200, body = ProposalView),
        (status = 404),
        (status = 409, description = "not confirmed with the stage's name (nothing is done), or it is already applied or dropped"),
    )
)]
pub(crate) async fn drop_proposal(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<ProposalId>,
    OptionalJson(Confirmation { confirm }): OptionalJson<Confirmation>,
) -> Result<Json<ProposalView>, Problem> {
    let view = proposal::find(&app, id).await?;
    if view.decided_at.is_none() {
        let effect = format!(
            "{} evaluations will never count; unfinished ones will be cancelled, and their datasets removed",
            view.evaluations.len()
        );
        Problem::check_confirmed(confirm.as_deref(), view.stage_name.as_str(), &effect)?;
    }
    let now = app.config.clock.now();
    app.store.drop_proposal(organiser.actor(), id, now).await?;
    tracing::info!(proposal = %id, "proposal dropped");
    proposal::find(&app, id).await.map(Json)
}

/// The dataset of an evaluation of a trial or of a proposal that is not applied. `None` for other evaluations, and for
/// viewers other than organisers.
///
/// # Errors
/// `Gone` if the proposal was dropped; `Conflict` if the evaluation has no dataset.
pub(super) async fn dataset(
    viewer: Viewer,
    app: &App,
    id: EvaluationId,
) -> Result<Option<StoredDataset>, Problem> {
    if viewer != Viewer::Organiser {
        return Ok(None);
    }
    let (proposal, evaluation) = match app.store.proposed_evaluation(id).await {
        Ok(found) => found,
        Err(StoreError::NotFound(_)) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    match proposal.outcome {
        // An evaluation of an applied proposal is an ordinary one.
        Some(ProposalOutcome::Applied(_)) => return Ok(None),
        Some(ProposalOutcome::Dropped(dropped_at)) => {
            return Err(Problem::new(
                ProblemKind::Gone,
                format!(
                    "the proposal {} was dropped at {dropped_at}, and its datasets removed; GET /api/v1/proposals/{} still returns its \
                     results",
                    proposal.id, proposal.id
                ),
            ));
        }
        None => {}
    }
    let no_dataset_reason = match evaluation.state {
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
            return Ok(Some(StoredDataset {
                team: evaluation.team,
                day,
                dataset,
                blake3: dataset_blake3,
            }));
        }
        EvaluationState::Queued | EvaluationState::Running { .. } | EvaluationState::Scoring => {
            "has not finished; poll it there until its state is “finished”"
        }
        EvaluationState::AgentFailed { .. } => {
            "has no dataset, because the agent had too many faults, which are listed there"
        }
        EvaluationState::PlatformFailed { .. }
        | EvaluationState::DeadlineMissed { .. }
        | EvaluationState::Cancelled { .. } => {
            "has no dataset, because it did not finish; the reason is given there"
        }
    };
    Err(Problem::new(
        ProblemKind::Conflict,
        format!(
            "the evaluation {id} of GET /api/v1/proposals/{} {no_dataset_reason}",
            proposal.id
        ),
    ))
}
