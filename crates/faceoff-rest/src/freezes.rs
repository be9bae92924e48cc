//! Boards that stand still, by the organiser.

use axum::{Json, extract::State};
use faceoff_api::{requests::Reason, views::stage::StageView};
use faceoff_service::{
    acts::settling,
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
};
use faceoff_types::StageId;

/// Freezes the boards of a stage: they show what they show now, and say so, until they are unfrozen. Days go on; what
/// is finished later is on none of them, but for the organiser (`live=true`).
#[utoipa::path(
    post, path = "/stages/{id}/freeze", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = Reason,
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "they are frozen"),
        (status = 422),
    )
)]
pub(crate) async fn freeze_boards(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<StageView>, Problem> {
    let frozen = settling::freeze_boards(&app, organiser.actor(), id, &reason);
    frozen.await.map(Json)
}

/// Has the boards of a stage show everything again, at once.
#[utoipa::path(
    post, path = "/stages/{id}/unfreeze", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "they are not frozen"),
    )
)]
pub(crate) async fn unfreeze_boards(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<StageView>, Problem> {
    let open = settling::unfreeze_boards(&app, organiser.actor(), id);
    open.await.map(Json)
}
