//! The season's stages: made and changed by the organiser, seen by everybody.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{NewStage, StageChange},
    views::stage::StageView,
};
use faceoff_service::{
    acts::staging,
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    viewer::Viewer,
    views::stage,
};
use faceoff_types::StageId;

/// All stages, the first to open first.
#[utoipa::path(
    get, path = "/stages", tag = "public", security((), ("team" = []), ("organiser" = [])),
    responses((status = 200, body = Vec<StageView>))
)]
pub(crate) async fn list_stages(
    viewer: Viewer,
    State(app): State<App>,
) -> Result<Json<Vec<StageView>>, Problem> {
    stage::all_seen_by(&app, viewer).await.map(Json)
}

/// One stage.
#[utoipa::path(
    get, path = "/stages/{id}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("id" = StageId, Path)),
    responses((status = 200, body = StageView), (status = 404))
)]
pub(crate) async fn stage(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<StageView>, Problem> {
    let view = stage::find(&app, id).await?;
    stage::seen_by(view, &app, viewer).await.map(Json)
}

/// Makes a stage: from its opening on its rules are fixed.
#[utoipa::path(
    post, path = "/stages", tag = "organiser", security(("organiser" = [])), request_body = NewStage,
    responses(
        (status = 201, body = StageView),
        (status = 409, description = "the name is taken, the times cannot be, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn create_stage(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewStage>,
) -> Result<(StatusCode, Json<StageView>), Problem> {
    let view = staging::create_stage(&app, organiser.actor(), new).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Changes a stage. Other rules of one that is open are another revision, which begins an empty board. `blind` false opens
/// a blind stage. Another `retention` is no other rule; what it would remove is to be confirmed.
#[utoipa::path(
    patch, path = "/stages/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = StageChange,
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "what is to be changed has begun or is over, the name is taken, other rules or standings of an open stage, or what another retention would remove, are not confirmed, it is signed off, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_stage(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(change): Body<StageChange>,
) -> Result<Json<StageView>, Problem> {
    let changed = staging::change_stage(&app, organiser.actor(), id, change);
    changed.await.map(Json)
}
