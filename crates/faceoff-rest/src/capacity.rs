//! Whether the days of a stage fit into their time.

use axum::{Json, extract::State};
use faceoff_api::views::capacity::CapacityView;
use faceoff_service::{
    app::App, auth::Organiser, extract::PathParam, problem::Problem, views::capacity,
};
use faceoff_types::StageId;

/// How the days that are under way, and the next one, fit into the time until their deadlines: expected and longest
/// hours on the slots that there are, with a sentence.
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
    capacity::of(&app, id).await.map(Json)
}
