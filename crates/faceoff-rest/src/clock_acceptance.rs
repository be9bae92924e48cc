//! The server's clock: it ignores a step of the system clock (a jump to another time) until an organiser accepts the step.

use axum::{extract::State, http::StatusCode};
use faceoff_api::requests::Confirmation;
use faceoff_service::{
    app::App, auth::Organiser, extract::Json as Body, problem::Problem, services::clock_step,
};

/// Accepts the time of the system clock after it was set to another time, so that the server uses it.
///
/// Until then the server continues its own time. `confirm` is the step's size, which `GET /health` and the response without
/// `confirm` name, such as `3600 s ahead`.
#[utoipa::path(
    post, path = "/clock/accept", tag = "organiser", security(("organiser" = [])), request_body = Confirmation,
    responses(
        (status = 204),
        (status = 409, description = "not confirmed with the step's size (nothing is done), or the system clock was not set"),
    )
)]
pub(crate) async fn accept_clock(
    organiser: Organiser,
    State(app): State<App>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<StatusCode, Problem> {
    clock_step::accept_step(&app, organiser.actor(), confirm.as_deref()).await?;
    Ok(StatusCode::NO_CONTENT)
}
