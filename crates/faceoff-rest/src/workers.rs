//! Remote workers, which are processes on other machines that run jobs: listing, banning and readmitting them.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{requests::Reason, views::workers::WorkersView};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::workers,
    views,
};
use faceoff_types::WorkerName;

/// Returns the remote workers with the state of their slots, their problems, and the bans.
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

/// Bans a worker: its results are rejected.
///
/// Its running jobs, and its parts of evaluations that have not ended, are run again by others. Results of ended
/// evaluations and games stay; `GET /workers` lists them.
#[utoipa::path(
    post, path = "/workers/{name}/ban", tag = "organiser", security(("organiser" = [])),
    params(("name" = String, Path, example = "rack-1")), request_body = Reason,
    responses(
        (status = 204),
        (status = 404, description = "not a valid worker name"),
        (status = 409, description = "the worker is already banned"),
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

/// Lifts a worker's ban.
#[utoipa::path(
    post, path = "/workers/{name}/readmit", tag = "organiser", security(("organiser" = [])),
    params(("name" = String, Path, example = "rack-1")),
    responses(
        (status = 204),
        (status = 404, description = "not a valid worker name"),
        (status = 409, description = "the worker is not banned"),
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
