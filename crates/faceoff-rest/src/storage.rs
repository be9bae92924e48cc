//! Disk usage of teams.

use axum::{Json, extract::State};
use faceoff_api::views::storage::StorageView;
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::PathParam,
    problem::Problem,
    views::storage,
};
use faceoff_store::StorageScope;
use faceoff_types::TeamId;

/// Returns the disk usage of all teams, by name.
#[utoipa::path(
    get, path = "/storage", tag = "organiser", security(("organiser" = [])),
    responses((status = 200, body = Vec<StorageView>))
)]
pub(crate) async fn storage(
    _: Organiser,
    State(app): State<App>,
) -> Result<Json<Vec<StorageView>>, Problem> {
    storage::all(&app).await.map(Json)
}

/// Returns the disk usage of a team. For the team and organisers.
#[utoipa::path(
    get, path = "/teams/{id}/storage", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = TeamId, Path)),
    responses((status = 200, body = StorageView), (status = 404))
)]
pub(crate) async fn team_storage(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
) -> Result<Json<StorageView>, Problem> {
    let team = app.store.team(id).await;
    caller.visible("team", team, |team| team.id)?;
    let scope = if caller.is_organiser() {
        StorageScope::All
    } else {
        StorageScope::VisibleToTeam
    };
    storage::find(&app, id, scope).await.map(Json)
}
