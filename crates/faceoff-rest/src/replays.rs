//! How sure a champion is: the schedule played again, on demand.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{requests::NewReplays, views::certainty::CertaintyView};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::replays,
};
use faceoff_store::MAX_REPLAYS;
use faceoff_types::TournamentId;

/// Has the whole schedule played again, so many times more, with the same submissions and fresh seeds, behind all that
/// counts. None of it counts, and no recording is kept.
#[utoipa::path(
    post, path = "/tournaments/{id}/replays", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewReplays,
    responses(
        (status = 201, body = CertaintyView),
        (status = 404),
        (status = 409, description = "a round is to come or under way, there would be more than 1000 replays or 10,000 games, or tournament or season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn order_replays(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(NewReplays { times }): Body<NewReplays>,
) -> Result<(StatusCode, Json<CertaintyView>), Problem> {
    if !(1..=MAX_REPLAYS).contains(&times) {
        let detail = format!("expected 1 to {MAX_REPLAYS}, got {times}");
        return Err(Problem::invalid("times", detail));
    }
    let now = app.config.clock.now();
    let games = app
        .store
        .order_replays(organiser.actor(), id, times, now)
        .await?;
    tracing::info!(tournament = %id, times, games, "replays ordered");
    let view = replays::certainty(&app, id).await?;
    Ok((StatusCode::CREATED, Json((*view).clone())))
}

/// Calls off the replays that are not over.
#[utoipa::path(
    delete, path = "/tournaments/{id}/replays", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses((status = 200, body = CertaintyView), (status = 404))
)]
pub(crate) async fn cancel_replays(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<CertaintyView>, Problem> {
    let now = app.config.clock.now();
    let games = app.store.cancel_replays(organiser.actor(), id, now).await?;
    tracing::info!(tournament = %id, games, "replays called off");
    let view = replays::certainty(&app, id).await?;
    Ok(Json((*view).clone()))
}

/// How often each team would have been champion, had the schedule been played with other seeds, with 95 % Wilson
/// intervals.
#[utoipa::path(
    get, path = "/tournaments/{id}/certainty", tag = "public", params(("id" = TournamentId, Path)),
    responses((status = 200, body = CertaintyView), (status = 404))
)]
pub(crate) async fn certainty(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<CertaintyView>, Problem> {
    let view = replays::certainty(&app, id).await?;
    Ok(Json((*view).clone()))
}
