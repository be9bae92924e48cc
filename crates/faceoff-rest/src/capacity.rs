//! Capacity forecasts: whether the evaluations of a stage's days will finish before their deadlines. A *slot* of a machine
//! runs one job at a time.

use axum::{Json, extract::State};
use faceoff_api::views::capacity::CapacityView;
use faceoff_service::{
    app::App, auth::Organiser, extract::PathParam, problem::Problem, views::capacity,
};
use faceoff_types::StageId;

/// Returns the capacity forecast of a stage's running days and the next one: expected and maximum hours on all slots,
/// compared with the time until their deadlines.
#[utoipa::path(
    get, path = "/stages/{id}/capacity", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    responses((status = 200, body = CapacityView), (status = 404))
)]
pub(crate) async fn capacity(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<CapacityView>, Problem> {
    capacity::build(&app, id).await.map(Json)
}
