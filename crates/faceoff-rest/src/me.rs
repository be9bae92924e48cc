//! The calling team: who it is, what plays for it today and what it enters next.

use axum::{Json, extract::State};
use faceoff_api::views::me::MeView;
use faceoff_service::{app::App, auth::TeamCaller, problem::Problem, views::me};

/// The calling team, what plays for it today, and what it enters at the next cut.
#[utoipa::path(
    get, path = "/me", tag = "team", security(("team" = [])), responses((status = 200, body = MeView))
)]
pub(crate) async fn me(
    caller: TeamCaller,
    State(app): State<App>,
) -> Result<Json<MeView>, Problem> {
    me::of(&app, caller.team).await.map(Json)
}
