//! The terms of taking part.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::NewTerms,
    views::{announcement::TermsView, person::PersonView},
};
use faceoff_service::{
    acts::{people, telling},
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::{announcement, person},
};

/// All versions of the terms, the newest first; none if taking part needs no consent.
#[utoipa::path(get, path = "/terms", tag = "public", responses((status = 200, body = Vec<TermsView>)))]
pub(crate) async fn list_terms(State(app): State<App>) -> Result<Json<Vec<TermsView>>, Problem> {
    let terms = app.store.terms().await?.into_iter();
    Ok(Json(terms.map(announcement::terms).collect()))
}

/// Publishes other terms. Teams upload and choose again once a member has accepted them; what is active plays on.
#[utoipa::path(
    post, path = "/terms", tag = "organiser", security(("organiser" = [])), request_body = NewTerms,
    responses((status = 201, body = TermsView), (status = 409, description = "they are what they were"), (status = 422))
)]
pub(crate) async fn publish_terms(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewTerms>,
) -> Result<(StatusCode, Json<TermsView>), Problem> {
    let terms = telling::publish_terms(&app, organiser.actor(), &new).await?;
    Ok((StatusCode::CREATED, Json(terms)))
}

/// The calling person accepts the terms.
#[utoipa::path(
    post, path = "/terms/{version}/accept", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("version" = u32, Path)),
    responses(
        (status = 200, body = PersonView),
        (status = 403, description = "it is no person who calls"),
        (status = 409, description = "it is not the newest version"),
    )
)]
pub(crate) async fn accept_terms(
    caller: Caller,
    State(app): State<App>,
    PathParam(version): PathParam<u32>,
) -> Result<Json<PersonView>, Problem> {
    let person = people::accept_terms(&app, &caller, version).await?;
    Ok(Json(person::of(person)))
}
