//! Submissions: following an agent's smoke run, using the day's turn for it.

use crate::{
    app::App,
    auth::{Caller, TeamCaller},
    extract::PathParam,
    paths,
    problem::Problem,
    views::{evaluation::EvaluationView, submission::SubmissionView},
};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_types::SubmissionId;

/// The calling team's submissions, newest first.
#[utoipa::path(
    get, path = "/submissions", tag = "team", security(("team" = [])),
    responses((status = 200, body = Vec<SubmissionView>))
)]
pub(crate) async fn list_submissions(
    TeamCaller(team): TeamCaller,
    State(app): State<App>,
) -> Result<Json<Vec<SubmissionView>>, Problem> {
    SubmissionView::of_team(&app, team.id).await.map(Json)
}

/// One submission with its verdict: the reason and the agent's log.
#[utoipa::path(
    get, path = "/submissions/{id}", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    responses((status = 200, body = SubmissionView), (status = 404))
)]
pub(crate) async fn submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let found = app.store.submission(id).await;
    let submission = caller.visible("submission", found, |submission| submission.team)?;
    SubmissionView::of(&app, submission).await.map(Json)
}

/// Uses the team's turn of today for this submission.
#[utoipa::path(
    post, path = "/submissions/{id}/evaluations", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    responses(
        (status = 201, body = EvaluationView),
        (status = 404),
        (status = 409, description = "the turn is used, the submission is not valid or came after the release of the day's seed, or the season is closed"),
    )
)]
pub(crate) async fn evaluate_submission(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<impl IntoResponse, Problem> {
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let evaluation = app
        .store
        .create_evaluation(caller.actor(), id, &app.config.plan, app.config.clock.now())
        .await?;
    let view = EvaluationView::of(&app, evaluation).await?;
    tracing::info!(team = %view.team_name, evaluation = %view.id, "evaluation queued");
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}
