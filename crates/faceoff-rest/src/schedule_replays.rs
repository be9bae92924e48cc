//! Replays of a tournament's schedule: all its games are played again with other seeds. How often each team then becomes
//! champion shows how certain the champion is.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{requests::NewScheduleReplays, views::champion_shares::ChampionSharesView};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::schedule_replays,
};
use faceoff_store::MAX_SCHEDULE_REPLAYS;
use faceoff_types::TournamentId;

/// Replays the whole schedule several times with the same submissions and other seeds.
///
/// Replays never count, are not recorded, and run behind all games that count.
#[utoipa::path(
    post, operation_id = "order_replays", path = "/tournaments/{id}/replays", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewScheduleReplays,
    responses(
        (status = 201, body = ChampionSharesView),
        (status = 404),
        (status = 409, description = "not all rounds are over, there would be more than 1000 replays or 10,000 games, or the tournament or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_replays(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(NewScheduleReplays { times }): Body<NewScheduleReplays>,
) -> Result<(StatusCode, Json<ChampionSharesView>), Problem> {
    if !(1..=MAX_SCHEDULE_REPLAYS).contains(&times) {
        let detail = format!("expected 1 to {MAX_SCHEDULE_REPLAYS}, got {times}");
        return Err(Problem::invalid("times", detail));
    }
    let now = app.config.clock.now();
    let games = app
        .store
        .request_schedule_replays(organiser.actor(), id, times, now)
        .await?;
    tracing::info!(tournament = %id, times, games, "replays queued");
    let view = schedule_replays::champion_shares(&app, id).await?;
    Ok((StatusCode::CREATED, Json((*view).clone())))
}

/// Cancels all unfinished replays.
#[utoipa::path(
    delete, path = "/tournaments/{id}/replays", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses((status = 200, body = ChampionSharesView), (status = 404))
)]
pub(crate) async fn cancel_replays(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<ChampionSharesView>, Problem> {
    let now = app.config.clock.now();
    let games = app
        .store
        .cancel_schedule_replays(organiser.actor(), id, now)
        .await?;
    tracing::info!(tournament = %id, games, "replays cancelled");
    let view = schedule_replays::champion_shares(&app, id).await?;
    Ok(Json((*view).clone()))
}

/// Returns how often each team becomes champion in the replays, with 95 % Wilson intervals.
#[utoipa::path(
    get, path = "/tournaments/{id}/certainty", tag = "public", params(("id" = TournamentId, Path)),
    responses((status = 200, body = ChampionSharesView), (status = 404))
)]
pub(crate) async fn certainty(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<ChampionSharesView>, Problem> {
    let view = schedule_replays::champion_shares(&app, id).await?;
    Ok(Json((*view).clone()))
}
