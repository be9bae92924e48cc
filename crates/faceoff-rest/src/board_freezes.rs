//! Freezing and unfreezing a stage's boards: frozen boards show no results after the moment of the freeze.

use axum::{Json, extract::State};
use faceoff_api::{requests::Reason, views::stage::StageView};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::stage_results,
    views::stage,
};
use faceoff_types::StageId;

/// Freezes the boards of a stage: results after this moment do not appear until the boards are unfrozen.
///
/// Evaluation days continue. Organisers see the live boards with `live=true`.
#[utoipa::path(
    post, path = "/stages/{id}/freeze", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = Reason,
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "the boards are already frozen"),
        (status = 422),
    )
)]
pub(crate) async fn freeze_boards(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<StageView>, Problem> {
    stage_results::freeze_boards(&app, organiser.actor(), id, &reason).await?;
    stage::find(&app, id).await.map(Json)
}

/// Unfreezes the boards of a stage: all results appear at once.
#[utoipa::path(
    post, path = "/stages/{id}/unfreeze", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "the boards are not frozen"),
    )
)]
pub(crate) async fn unfreeze_boards(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<StageView>, Problem> {
    stage_results::unfreeze_boards(&app, organiser.actor(), id).await?;
    stage::find(&app, id).await.map(Json)
}
