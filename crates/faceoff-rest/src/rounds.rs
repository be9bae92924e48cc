//! The rounds of a tournament, started by the organiser.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::views::tournament::RoundView;
use faceoff_service::{
    acts::drawing,
    app::App,
    auth::Organiser,
    extract::PathParam,
    problem::Problem,
    views::{tournament, tournament_sheet::TournamentSheet},
};
use faceoff_types::TournamentId;

/// Draws the next round and starts it: what each team has active now plays all of it, and its games are queued,
/// matchday by matchday. Everything that is drawn follows from the season's secret and the results so far.
#[utoipa::path(
    post, path = "/tournaments/{id}/rounds", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses(
        (status = 201, body = RoundView),
        (status = 404),
        (status = 409, description = "nothing is done: a game of an earlier round has no result, a team has no valid active submission that the tournament takes (it is named: wait, or withdraw it), fewer than two teams are in it, the groups do not fit them, all rounds are over, another request has just started it, or it or the season is closed"),
    )
)]
pub(crate) async fn start_round(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<(StatusCode, Json<RoundView>), Problem> {
    let started = drawing::start_round(&app, organiser.actor(), id).await?;
    let sheet = TournamentSheet::find(&app, id).await?;
    tracing::info!(
        tournament = %sheet.tournament.name, %id, round = %started.number, "round started"
    );
    let view = tournament::round_of(&sheet, &started)?;
    Ok((StatusCode::CREATED, Json(view)))
}
