//! Ratings of a tournament's submissions, which estimate their strength, and head-to-head records of its teams.

use axum::{Json, extract::State};
use faceoff_scoring::tournament::{HeadToHead, rating::Ratings};
use faceoff_service::{app::App, extract::PathParam, problem::Problem, views::ratings};
use faceoff_types::TournamentId;

/// Returns Bradley–Terry ratings of the submissions that played, from results and from goals, with confidence
/// intervals. For information only: they do not affect the standings.
#[utoipa::path(
    get, path = "/tournaments/{id}/ratings", tag = "public", params(("id" = TournamentId, Path)),
    responses(
        (status = 200, body = Ratings),
        (status = 404),
        (status = 409, description = "the games connect more submissions than the rating supports"),
    )
)]
pub(crate) async fn ratings(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<Ratings>, Problem> {
    let rated = ratings::ratings(&app, id).await?;
    Ok(Json((*rated).clone()))
}

/// Returns the head-to-head record of each pair of teams that met.
#[utoipa::path(
    get, path = "/tournaments/{id}/head-to-head", tag = "public", params(("id" = TournamentId, Path)),
    responses((status = 200, body = Vec<HeadToHead>), (status = 404))
)]
pub(crate) async fn head_to_head(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<Vec<HeadToHead>>, Problem> {
    ratings::head_to_head_records(&app, id).await.map(Json)
}
