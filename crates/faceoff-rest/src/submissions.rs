//! Submissions: listing, activating, withdrawing and describing them.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{requests::SubmissionChange, views::submission::SubmissionView};
use faceoff_service::{
    app::App,
    auth::{Caller, TeamCaller},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    services::submissions,
    views::submission,
};
use faceoff_types::SubmissionId;

/// Lists the calling team's submissions, newest first.
#[utoipa::path(
    get, path = "/submissions", tag = "team", security(("team" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<SubmissionView>))
)]
pub(crate) async fn list_submissions(
    caller: TeamCaller,
    page: Page<SubmissionId>,
    State(app): State<App>,
) -> Result<Paged<SubmissionView>, Problem> {
    let team = caller.team.id;
    let rows = app
        .store
        .submissions_after(team, page.after, page.limit + 1);
    let rows = rows.await?.ok_or_else(|| page.unknown_row())?;
    let page = page.page(rows, |submission| submission.id);
    page.map_all(async |rows| submission::all(&app, rows).await)
        .await
}

/// Returns a submission with its verdict: the reason and the agent's log.
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
    submission::build(&app, submission).await.map(Json)
}

/// Activates a submission: the next cutoff evaluates it, unless a later upload becomes valid before.
///
/// Evaluations whose cutoff has passed are not affected.
#[utoipa::path(
    post, path = "/submissions/{id}/activate", tag = "team", security(("team" = [])),
    params(("id" = SubmissionId, Path)),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "the submission is not valid (yet), or the season is closed"),
    )
)]
pub(crate) async fn activate_submission(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let active = submissions::activate_submission(&app, &caller, id).await?;
    submission::build(&app, active).await.map(Json)
}

/// Withdraws a submission: it is not evaluated any more, unless it is activated again.
///
/// If it was active, the team has no active submission. Evaluations whose cutoff has passed are not affected.
#[utoipa::path(
    post, path = "/submissions/{id}/withdraw", tag = "team", security(("team" = [])),
    params(("id" = SubmissionId, Path)),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "the submission is already withdrawn or not valid, or the season is closed"),
    )
)]
pub(crate) async fn withdraw_submission(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let withdrawn = submissions::withdraw_submission(&app, &caller, id).await?;
    submission::build(&app, withdrawn).await.map(Json)
}

/// Changes label and note of a submission. Only its team and organisers see them.
#[utoipa::path(
    patch, path = "/submissions/{id}", tag = "team", security(("team" = [])),
    params(("id" = SubmissionId, Path)), request_body = SubmissionChange,
    responses((status = 200, body = SubmissionView), (status = 404), (status = 422))
)]
pub(crate) async fn describe_submission(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    Body(change): Body<SubmissionChange>,
) -> Result<Json<SubmissionView>, Problem> {
    let described = submissions::describe_submission(&app, &caller, id, &change).await?;
    submission::build(&app, described).await.map(Json)
}

/// Gone: single submissions cannot be evaluated on demand.
#[utoipa::path(
    post, path = "/submissions/{id}/evaluations", tag = "team",
    params(("id" = String, Path)),
    responses((status = 410, description = "always; the detail names the alternative"))
)]
pub(crate) async fn evaluate_submission() -> Problem {
    Problem::new(
        ProblemKind::Gone,
        "single submissions can no longer be evaluated on demand, because later ones could know more about the day's \
         episodes. Each day has one cutoff, by the schedule or an organiser, at which the active submission of each team is \
         evaluated: the newest valid one, unless the team activates another with POST \
         /api/v1/submissions/ID/activate. GET /api/v1/me shows the active submission and the next cutoff",
    )
}
