//! Runtimes, the environments in which agents run, and the resource limits of agents.

use axum::{Json, extract::State};
use faceoff_api::views::runtimes::RuntimesView;
use faceoff_service::{app::App, problem::Problem, views::runtimes};

/// Returns the runtimes with their interpreters and packages, as found inside the sandbox at the server's start; the
/// machine; and the resource limits of the server and of each stage and tournament that has not ended.
#[utoipa::path(get, path = "/runtimes", tag = "public", responses((status = 200, body = RuntimesView)))]
pub(crate) async fn runtimes(State(app): State<App>) -> Result<Json<RuntimesView>, Problem> {
    runtimes::build(&app).await.map(Json)
}
