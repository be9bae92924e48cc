//! Rounds of a tournament: starting the next one. A round consists of matchdays, whose games can run in parallel.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::views::tournament::RoundView;
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::PathParam,
    problem::Problem,
    services::tournament_rounds,
    views::{tournament, tournament_state::TournamentState},
};
use faceoff_types::TournamentId;

/// Draws and starts the next round: the active submissions of this moment play the whole round, and its games are
/// queued by matchday.
///
/// The draw follows from the season secret and the results so far.
#[utoipa::path(
    post, path = "/tournaments/{id}/rounds", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses(
        (status = 201, body = RoundView),
        (status = 404),
        (status = 409, description = "nothing is done: a game of an earlier round has no result; a team has no active submission that the tournament accepts (the detail names it: wait, or withdraw it); there are fewer than two teams; the groups do not fit their number; all rounds are over; another request has just started the round; or the tournament or the season is closed"),
    )
)]
pub(crate) async fn start_round(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<(StatusCode, Json<RoundView>), Problem> {
    let started = tournament_rounds::start_round(&app, organiser.actor(), id, None).await?;
    let state = TournamentState::find(&app, id).await?;
    tracing::info!(
        tournament = %state.tournament.name, %id, round = %started.number, "round started"
    );
    let view = tournament::round_view(&state, &started)?;
    Ok((StatusCode::CREATED, Json(view)))
}
