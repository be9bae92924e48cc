//! Liveness and readiness of the server.

use axum::{Json, extract::State};
use faceoff_api::views::health::{HealthView, LiveView};
use faceoff_service::{app::App, problem::Problem, views::health};

/// Readiness: checks that the database is writable (by a test write, at most once a second), the queue makes progress,
/// the disks have free space, and the system clock has not been set to another time.
///
/// Otherwise the response is a problem whose `database`, `queue`, `free_space` and `clock` say what is wrong.
#[utoipa::path(
    get, path = "/health", tag = "public",
    responses(
        (status = 200, body = HealthView),
        (status = 503, description = "not ready; the server recovers automatically once the problem is fixed"),
    )
)]
pub(crate) async fn health(State(app): State<App>) -> Result<Json<HealthView>, Problem> {
    health::check(&app).await.map(Json)
}

/// Liveness: the server process responds. Do not restart a server only because it is not ready.
#[utoipa::path(get, path = "/health/live", tag = "public", responses((status = 200, body = LiveView)))]
pub(crate) async fn live() -> Json<LiveView> {
    Json(LiveView::ALIVE)
}
