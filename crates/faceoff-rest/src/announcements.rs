//! What is told to everybody, and what teams ask.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{NewAnnouncement, NewAnswer, NewQuestion},
    views::announcement::{AnnouncementView, QuestionView},
};
use faceoff_service::{
    acts::telling,
    app::App,
    auth::{Anybody, Organiser, TeamCaller},
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::announcement,
};
use faceoff_types::{AnnouncementId, QuestionId};

/// What the organisers have told everybody, the newest first.
#[utoipa::path(
    get, path = "/announcements", tag = "public",
    params(PageQuery), responses((status = 200, body = Vec<AnnouncementView>))
)]
pub(crate) async fn list_announcements(
    page: Page<AnnouncementId>,
    State(app): State<App>,
) -> Result<Paged<AnnouncementView>, Problem> {
    let announcements = app.store.announcements(u32::MAX).await?;
    let page = page.cut(announcements, |announcement| announcement.id)?;
    Ok(page.map(announcement::of))
}

/// Tells everybody; what was told stays.
#[utoipa::path(
    post, path = "/announcements", tag = "organiser", security(("organiser" = [])), request_body = NewAnnouncement,
    params(PageQuery),
    responses((status = 201, body = AnnouncementView), (status = 422))
)]
pub(crate) async fn announce(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewAnnouncement>,
) -> Result<(StatusCode, Json<AnnouncementView>), Problem> {
    let view = telling::announce(&app, organiser.actor(), &new).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Questions, the newest first: for everybody those with a public answer, for a team also its own, for organisers all.
#[utoipa::path(
    get, path = "/questions", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<QuestionView>))
)]
pub(crate) async fn list_questions(
    caller: Anybody,
    page: Page<QuestionId>,
    State(app): State<App>,
) -> Result<Paged<QuestionView>, Problem> {
    let shown = telling::questions(&app, caller.0.as_ref()).await?;
    page.cut(shown, |question| question.id)
}

/// Asks the organisers. Other teams read it only with a public answer, and never who asked.
#[utoipa::path(
    post, path = "/questions", tag = "team", security(("team" = [])), request_body = NewQuestion,
    responses(
        (status = 201, body = QuestionView),
        (status = 409, description = "too many of the team's wait for an answer"),
        (status = 422),
    )
)]
pub(crate) async fn ask(
    caller: TeamCaller,
    State(app): State<App>,
    Body(new): Body<NewQuestion>,
) -> Result<(StatusCode, Json<QuestionView>), Problem> {
    let view = telling::ask(&app, &caller, &new).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Answers a question, or answers it anew.
#[utoipa::path(
    put, path = "/questions/{id}/answer", tag = "organiser", security(("organiser" = [])),
    params(("id" = QuestionId, Path)), request_body = NewAnswer,
    responses((status = 200, body = QuestionView), (status = 404), (status = 422))
)]
pub(crate) async fn answer(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<QuestionId>,
    Body(new): Body<NewAnswer>,
) -> Result<Json<QuestionView>, Problem> {
    let answered = telling::answer(&app, organiser.actor(), id, &new);
    answered.await.map(Json)
}
