//! Is the server up, and is it fit for work?

use axum::{Json, extract::State};
use faceoff_api::views::health::{HealthView, LiveView};
use faceoff_service::{app::App, problem::Problem, views::health};

/// Readiness: the database can be written (it is tried, once a second at most), the queue moves, and the
/// disks have room. Otherwise a problem, whose `database`, `queue` and `room` say what is missing.
#[utoipa::path(
    get, path = "/health", tag = "public",
    responses(
        (status = 200, body = HealthView),
        (status = 503, description = "not ready; the server goes on by itself once what is missing is back"),
    )
)]
pub(crate) async fn health(State(app): State<App>) -> Result<Json<HealthView>, Problem> {
    health::now(&app).await.map(Json)
}

/// Liveness: the process answers, whatever it lacks. A server that is not ready is not to be restarted
/// for that.
#[utoipa::path(get, path = "/health/live", tag = "public", responses((status = 200, body = LiveView)))]
pub(crate) async fn live() -> Json<LiveView> {
    Json(LiveView::ALIVE)
}
