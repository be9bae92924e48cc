//! Boards that stand still, by the organiser.

use super::rulings::checked_reason;
use crate::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    requests::Reason,
    views::stage::StageView,
};
use axum::{Json, extract::State};
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
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    app.store
        .freeze_boards(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(stage = %id, reason, "boards frozen");
    StageView::find(&app, id).await.map(Json)
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
    let now = app.config.clock.now();
    app.store
        .unfreeze_boards(organiser.actor(), id, now)
        .await?;
    tracing::info!(stage = %id, "boards unfrozen");
    StageView::find(&app, id).await.map(Json)
}
