//! Submissions: following an agent's smoke run, choosing what plays.

use crate::{
    app::App,
    auth::{Caller, TeamCaller},
    extract::{Json as Body, PathParam},
    paging::{Page, PageQuery, Paged},
    problem::{Problem, ProblemKind},
    requests::SubmissionChange,
    views::submission::SubmissionView,
};
use axum::{Json, extract::State};
use faceoff_store::SubmissionWords;
use faceoff_types::SubmissionId;

/// Longest name that a team has for a submission.
const MAX_LABEL_CHARS: usize = 80;

/// Longest note of a team on a submission.
const MAX_NOTE_CHARS: usize = 2000;

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
    page.seen(async |rows| SubmissionView::all(&app, rows).await)
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
    SubmissionView::of(&app, submission).await.map(Json)
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
    let (actor, name) = (caller.actor(), &caller.team.name);
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let now = app.config.clock.now();
    let submission = app.store.activate_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission activated");
    SubmissionView::of(&app, submission).await.map(Json)
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
    let (actor, name) = (caller.actor(), &caller.team.name);
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let now = app.config.clock.now();
    let submission = app.store.withdraw_submission(actor, id, now).await?;
    tracing::info!(team = %name, submission = %id, "submission withdrawn");
    SubmissionView::of(&app, submission).await.map(Json)
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
    let found = app.store.submission(id).await;
    caller.visible("submission", found, |submission| submission.team)?;
    let words = SubmissionWords {
        label: said("label", &change.label, MAX_LABEL_CHARS)?,
        note: said("note", &change.note, MAX_NOTE_CHARS)?,
    };
    if words.label.is_none() && words.note.is_none() {
        let detail = "expected label, note, or both; there is nothing to change";
        return Err(Problem::new(ProblemKind::InvalidContent, detail));
    }
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let submission = app.store.describe_submission(actor, id, words, now).await?;
    SubmissionView::of(&app, submission).await.map(Json)
}

/// Words without the space around them, if they are given and not too many.
#[expect(clippy::option_option, reason = "null and left out are told apart")]
fn said<'w>(
    field: &str,
    words: &'w Option<Option<String>>,
    most_chars: usize,
) -> Result<Option<Option<&'w str>>, Problem> {
    let words = words.as_ref().map(|words| words.as_deref().map(str::trim));
    let chars = words.flatten().map_or(1, |words| words.chars().count());
    if !(1..=most_chars).contains(&chars) {
        let detail = format!("expected 1 to {most_chars} characters, or null, got {chars}");
        return Err(Problem::invalid(field, detail));
    }
    Ok(words)
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
