//! Registrations: requests of new teams to take part, which organisers approve or refuse.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{Reason, RegistrationRequest},
    views::invitation::{NewRegistrationView, RegistrationView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::registrations,
    views::invitation,
};
use faceoff_types::RegistrationId;

/// Registers a team, if the season accepts registrations. The organisers approve or refuse it.
#[utoipa::path(
    post, path = "/registrations", tag = "public", request_body = RegistrationRequest,
    responses(
        (status = 201, body = NewRegistrationView),
        (status = 409, description = "registration is closed, too many registrations are pending, the name is taken, or the terms are not accepted"),
        (status = 422),
    )
)]
pub(crate) async fn register(
    State(app): State<App>,
    Body(request): Body<RegistrationRequest>,
) -> Result<(StatusCode, Json<NewRegistrationView>), Problem> {
    let view = registrations::register(&app, request).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Lists all registrations, newest first.
#[utoipa::path(
    get, path = "/registrations", tag = "organiser", security(("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<RegistrationView>))
)]
pub(crate) async fn list_registrations(
    _: Organiser,
    page: Page<RegistrationId>,
    State(app): State<App>,
) -> Result<Paged<RegistrationView>, Problem> {
    let registrations = app.store.registrations().await?;
    let page = page.select(registrations, |registration| registration.id)?;
    Ok(page.map(invitation::registration))
}

/// Approves a registration and creates the team. The registration's link lets the first member join, for seven days
/// from now.
#[utoipa::path(
    post, path = "/registrations/{id}/approve", tag = "organiser", security(("organiser" = [])),
    params(("id" = RegistrationId, Path)),
    responses(
        (status = 200, body = RegistrationView),
        (status = 404),
        (status = 409, description = "it was already approved or refused, or the name has been taken meanwhile"),
    )
)]
pub(crate) async fn approve_registration(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<RegistrationId>,
) -> Result<Json<RegistrationView>, Problem> {
    let approved =
        registrations::approve_registration(&app, organiser.actor(), organiser.requester(), id)
            .await?;
    Ok(Json(invitation::registration(approved)))
}

/// Refuses a registration.
#[utoipa::path(
    post, path = "/registrations/{id}/refuse", tag = "organiser", security(("organiser" = [])),
    params(("id" = RegistrationId, Path)), request_body = Reason,
    responses(
        (status = 200, body = RegistrationView),
        (status = 404), (status = 409, description = "it was already approved or refused"), (status = 422),
    )
)]
pub(crate) async fn refuse_registration(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<RegistrationId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<RegistrationView>, Problem> {
    let actor = organiser.actor();
    let refused = registrations::refuse_registration(&app, actor, id, &reason).await?;
    Ok(Json(invitation::registration(refused)))
}
