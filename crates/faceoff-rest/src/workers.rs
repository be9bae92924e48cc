//! Who works for the server on other machines.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{requests::Reason, views::workers::WorkersView};
use faceoff_service::{
    acts::workers,
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views,
};
use faceoff_store::WorkerName;

/// Who plays beside the server's own slots, what they do, what keeps others from it, and of whom nothing is taken.
#[utoipa::path(
    get, path = "/workers", tag = "organiser", security(("organiser" = [])),
    responses((status = 200, body = WorkersView))
)]
pub(crate) async fn workers(
    _: Organiser,
    State(app): State<App>,
) -> Result<Json<WorkersView>, Problem> {
    views::workers::with_bans(&app).await.map(Json)
}

/// Takes nothing of a worker any more. What it plays now, and what it has played of evaluations that go on, is played again by others; what
/// is over stays, and `GET /workers` lists it.
#[utoipa::path(
    post, path = "/workers/{name}/ban", tag = "organiser", security(("organiser" = [])),
    params(("name" = String, Path, example = "rack-1")), request_body = Reason,
    responses(
        (status = 204),
        (status = 404, description = "no worker can be called so"),
        (status = 409, description = "it is banned"),
        (status = 422),
    )
)]
pub(crate) async fn ban_worker(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(name): PathParam<WorkerName>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<StatusCode, Problem> {
    workers::ban_worker(&app, organiser.actor(), &name, &reason).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Takes a worker's work again.
#[utoipa::path(
    post, path = "/workers/{name}/readmit", tag = "organiser", security(("organiser" = [])),
    params(("name" = String, Path, example = "rack-1")),
    responses(
        (status = 204),
        (status = 404, description = "no worker can be called so"),
        (status = 409, description = "it is not banned"),
    )
)]
pub(crate) async fn readmit_worker(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(name): PathParam<WorkerName>,
) -> Result<StatusCode, Problem> {
    workers::readmit_worker(&app, organiser.actor(), &name).await?;
    Ok(StatusCode::NO_CONTENT)
}
