//! Announcements of the organisers, and questions of teams with the organisers' answers.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{NewAnnouncement, NewAnswer, NewQuestion},
    views::announcement::{AnnouncementView, QuestionView},
};
use faceoff_service::{
    app::App,
    auth::{OptionalCaller, Organiser, TeamCaller},
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::announcements,
    views::announcement,
};
use faceoff_types::{AnnouncementId, QuestionId};

/// Lists the organisers' announcements, newest first.
#[utoipa::path(
    get, path = "/announcements", tag = "public",
    params(PageQuery), responses((status = 200, body = Vec<AnnouncementView>))
)]
pub(crate) async fn list_announcements(
    page: Page<AnnouncementId>,
    State(app): State<App>,
) -> Result<Paged<AnnouncementView>, Problem> {
    let announcements = app.store.announcements(u32::MAX).await?;
    let page = page.select(announcements, |announcement| announcement.id)?;
    Ok(page.map(announcement::view))
}

/// Publishes an announcement. It cannot be changed or removed.
#[utoipa::path(
    post, path = "/announcements", tag = "organiser", security(("organiser" = [])), request_body = NewAnnouncement,
    responses((status = 201, body = AnnouncementView), (status = 422))
)]
pub(crate) async fn announce(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewAnnouncement>,
) -> Result<(StatusCode, Json<AnnouncementView>), Problem> {
    let published = announcements::announce(&app, organiser.actor(), &new).await?;
    Ok((StatusCode::CREATED, Json(announcement::view(published))))
}

/// Lists questions, newest first. Visitors see those with a public answer, teams also their own, organisers all.
#[utoipa::path(
    get, path = "/questions", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<QuestionView>))
)]
pub(crate) async fn list_questions(
    caller: OptionalCaller,
    page: Page<QuestionId>,
    State(app): State<App>,
) -> Result<Paged<QuestionView>, Problem> {
    let visible = announcements::questions(&app, caller.0.as_ref()).await?;
    page.select(visible, |question| question.id)
}

/// Asks the organisers a question. Other teams see it only with a public answer, and never the asking team.
#[utoipa::path(
    post, path = "/questions", tag = "team", security(("team" = [])), request_body = NewQuestion,
    responses(
        (status = 201, body = QuestionView),
        (status = 409, description = "the team has too many unanswered questions"),
        (status = 422),
    )
)]
pub(crate) async fn ask(
    caller: TeamCaller,
    State(app): State<App>,
    Body(question): Body<NewQuestion>,
) -> Result<(StatusCode, Json<QuestionView>), Problem> {
    let asked = announcements::ask(&app, &caller, &question).await?;
    let shows_team = true;
    let view = announcement::question(asked, shows_team);
    Ok((StatusCode::CREATED, Json(view)))
}

/// Answers a question, or replaces its answer.
#[utoipa::path(
    put, path = "/questions/{id}/answer", tag = "organiser", security(("organiser" = [])),
    params(("id" = QuestionId, Path)), request_body = NewAnswer,
    responses((status = 200, body = QuestionView), (status = 404), (status = 422))
)]
pub(crate) async fn answer(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<QuestionId>,
    Body(new_answer): Body<NewAnswer>,
) -> Result<Json<QuestionView>, Problem> {
    let answered = announcements::answer(&app, organiser.actor(), id, &new_answer).await?;
    let shows_team = true;
    Ok(Json(announcement::question(answered, shows_team)))
}
