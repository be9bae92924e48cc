//! Stages, the periods of a season with rules and boards of their own: listing, creating and changing them. When the rules
//! of an open stage change, a new *revision* begins.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{NewStage, StagePatch},
    views::stage::StageView,
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::stages,
    viewer::Viewer,
    views::stage,
};
use faceoff_store::Stage;
use faceoff_types::StageId;

/// Lists all stages, in order of their opening.
#[utoipa::path(
    get, path = "/stages", tag = "public", security((), ("team" = []), ("organiser" = [])),
    responses((status = 200, body = Vec<StageView>))
)]
pub(crate) async fn list_stages(
    viewer: Viewer,
    State(app): State<App>,
) -> Result<Json<Vec<StageView>>, Problem> {
    stage::all_for_viewer(&app, viewer).await.map(Json)
}

/// Returns a stage.
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
    stage::for_viewer(view, &app, viewer).await.map(Json)
}

/// Creates a stage. Its rules are fixed once it opens.
#[utoipa::path(
    post, path = "/stages", tag = "organiser", security(("organiser" = [])), request_body = NewStage,
    responses(
        (status = 201, body = StageView),
        (status = 409, description = "the name is taken, the times are impossible, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn create_stage(
    organiser: Organiser,
    State(app): State<App>,
    Body(request): Body<NewStage>,
) -> Result<(StatusCode, Json<StageView>), Problem> {
    let created = stages::create_stage(&app, organiser.actor(), request).await?;
    let view = organiser_view(&app, created).await?;
    Ok((StatusCode::CREATED, Json(view)))
}

/// Changes a stage.
///
/// New rules of an open stage begin a new revision with an empty board. `blind: false` reveals a blind stage. Another
/// `retention` does not begin a revision, but must be confirmed if it removes files.
#[utoipa::path(
    patch, path = "/stages/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = StagePatch,
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "the field can no longer be changed; the name is taken; new rules or standings of an open stage, or a retention that removes files, are not confirmed; the stage is signed off; or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_stage(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(change): Body<StagePatch>,
) -> Result<Json<StageView>, Problem> {
    let changed = stages::change_stage(&app, organiser.actor(), id, change).await?;
    organiser_view(&app, changed).await.map(Json)
}

async fn organiser_view(app: &App, changed: Stage) -> Result<StageView, Problem> {
    let view = stage::build(app, changed).await?;
    stage::for_viewer(view, app, Viewer::Organiser).await
}
