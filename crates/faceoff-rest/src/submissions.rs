//! Submissions: following an agent's smoke run, choosing what plays.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{requests::SubmissionChange, views::submission::SubmissionView};
use faceoff_service::{
    acts::entering_days,
    app::App,
    auth::{Caller, TeamCaller},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    views::submission,
};
use faceoff_types::SubmissionId;

/// The calling team's submissions, newest first.
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
    let rows = rows.await?.ok_or_else(|| page.unknown())?;
    let page = page.of_more(rows, |submission| submission.id);
    page.seen(async |rows| submission::all(&app, rows).await)
        .await
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
    submission::of(&app, submission).await.map(Json)
}

/// Chooses the submission that the team enters at the next cut, until a later upload turns valid.
///
/// A day that had its cut goes on with what was active then.
#[utoipa::path(
    post, path = "/submissions/{id}/activate", tag = "team", security(("team" = [])),
    params(("id" = SubmissionId, Path)),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "it is not valid (yet), or the season is closed"),
    )
)]
pub(crate) async fn activate_submission(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let active = entering_days::activate_submission(&app, &caller, id);
    active.await.map(Json)
}

/// Takes a submission back: it enters no further day, unless it is chosen again.
///
/// If it was active, nothing of the team is. A day that had its cut goes on.
#[utoipa::path(
    post, path = "/submissions/{id}/withdraw", tag = "team", security(("team" = [])),
    params(("id" = SubmissionId, Path)),
    responses(
        (status = 200, body = SubmissionView),
        (status = 404),
        (status = 409, description = "it is withdrawn, plays no day as it is, or the season is closed"),
    )
)]
pub(crate) async fn withdraw_submission(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<SubmissionView>, Problem> {
    let withdrawn = entering_days::withdraw_submission(&app, &caller, id);
    withdrawn.await.map(Json)
}

/// Changes what a team says of a submission: a name for it, and a note. Only the team and the organiser read them.
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
    let described = entering_days::describe_submission(&app, &caller, id, &change);
    described.await.map(Json)
}

/// Gone: nobody starts the evaluation of a single submission.
#[utoipa::path(
    post, path = "/submissions/{id}/evaluations", tag = "team",
    params(("id" = String, Path)),
    responses((status = 410, description = "always; the detail says what there is instead"))
)]
pub(crate) async fn evaluate_submission() -> Problem {
    Problem::new(
        ProblemKind::Gone,
        "evaluations are no longer started one by one: whoever plays later could know more of the day's \
         episodes. A day has one cut, by the schedule or the organiser, and what a team has active then \
         plays: by itself its newest valid submission, or the one it chooses with POST \
         /api/v1/submissions/ID/activate. GET /api/v1/me says which is active, and when the next cut is",
    )
}
