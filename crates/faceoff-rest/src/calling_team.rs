//! Status of the calling team (`GET /me`).

use axum::{Json, extract::State};
use faceoff_api::views::me::MeView;
use faceoff_service::{app::App, auth::TeamCaller, problem::Problem, views::me};

/// Returns the calling team, its evaluation of today, and the submission that the next cutoff evaluates.
#[utoipa::path(
    get, path = "/me", tag = "team", security(("team" = [])), responses((status = 200, body = MeView))
)]
pub(crate) async fn me(
    caller: TeamCaller,
    State(app): State<App>,
) -> Result<Json<MeView>, Problem> {
    me::build(&app, caller.team).await.map(Json)
}
