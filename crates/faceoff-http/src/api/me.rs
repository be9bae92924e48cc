//! The calling team: who it is and what it may do today.

use crate::{app::App, auth::TeamCaller, problem::Problem, views::me::MeView};
use axum::{Json, extract::State};

/// The calling team and its turn of today.
#[utoipa::path(
    get, path = "/me", tag = "team", security(("team" = [])), responses((status = 200, body = MeView))
)]
pub(crate) async fn me(
    TeamCaller(team): TeamCaller,
    State(app): State<App>,
) -> Result<Json<MeView>, Problem> {
    MeView::of(&app, team).await.map(Json)
}
