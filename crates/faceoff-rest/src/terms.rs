//! Terms of participation: publishing and accepting them.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::NewTerms,
    views::{announcement::TermsView, user::UserView},
};
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::{announcements, users},
    views::{announcement, user},
};

/// Lists all versions of the terms, newest first; empty if there are none.
#[utoipa::path(get, path = "/terms", tag = "public", responses((status = 200, body = Vec<TermsView>)))]
pub(crate) async fn list_terms(State(app): State<App>) -> Result<Json<Vec<TermsView>>, Problem> {
    let terms = app.store.terms().await?.into_iter();
    Ok(Json(terms.map(announcement::terms).collect()))
}

/// Publishes a new version of the terms. Teams can upload and activate submissions again once a member has accepted it;
/// active submissions stay active.
#[utoipa::path(
    post, path = "/terms", tag = "organiser", security(("organiser" = [])), request_body = NewTerms,
    responses((status = 201, body = TermsView), (status = 409, description = "the text equals the current version"), (status = 422))
)]
pub(crate) async fn publish_terms(
    organiser: Organiser,
    State(app): State<App>,
    Body(new_terms): Body<NewTerms>,
) -> Result<(StatusCode, Json<TermsView>), Problem> {
    let terms = announcements::publish_terms(&app, organiser.actor(), &new_terms).await?;
    Ok((StatusCode::CREATED, Json(announcement::terms(terms))))
}

/// Accepts the terms for the calling user.
#[utoipa::path(
    post, path = "/terms/{version}/accept", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("version" = u32, Path)),
    responses(
        (status = 200, body = UserView),
        (status = 403, description = "the token is not a user's"),
        (status = 409, description = "not the newest version"),
    )
)]
pub(crate) async fn accept_terms(
    caller: Caller,
    State(app): State<App>,
    PathParam(version): PathParam<u32>,
) -> Result<Json<UserView>, Problem> {
    let user = users::accept_terms(&app, &caller, version).await?;
    Ok(Json(user::view(user)))
}
