//! What agents find on this server.

use axum::{Json, extract::State};
use faceoff_api::views::runtimes::RuntimesView;
use faceoff_service::{app::App, problem::Problem, views::runtimes};

/// What agents find here: each runtime with its interpreter and packages, as found inside the sandbox when the server
/// started; the machine; and the limits, the server's and those of each stage and tournament that is not over.
#[utoipa::path(get, path = "/runtimes", tag = "public", responses((status = 200, body = RuntimesView)))]
pub(crate) async fn runtimes(State(app): State<App>) -> Result<Json<RuntimesView>, Problem> {
    runtimes::now(&app).await.map(Json)
}
