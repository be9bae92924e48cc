//! Tournaments: creating, changing, pausing and closing them.

use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{
    paths,
    requests::{Confirmation, NewTournament, Reason, TournamentChange},
    views::tournament::{TournamentSummary, TournamentView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::tournaments,
    views::tournament,
};
use faceoff_types::TournamentId;

/// Lists all tournaments, in order of creation.
#[utoipa::path(
    get, path = "/tournaments", tag = "public", responses((status = 200, body = Vec<TournamentSummary>))
)]
pub(crate) async fn list_tournaments(
    State(app): State<App>,
) -> Result<Json<Vec<TournamentSummary>>, Problem> {
    tournament::summaries(&app).await.map(Json)
}

/// Returns a tournament: rules, entrants, rounds and standings.
#[utoipa::path(
    get, path = "/tournaments/{id}", tag = "public", params(("id" = TournamentId, Path)),
    responses((status = 200, body = TournamentView), (status = 404))
)]
pub(crate) async fn tournament(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<TournamentView>, Problem> {
    tournament::find(&app, id).await.map(Json)
}

/// Creates a tournament. Until its first round starts, entrants and rules may change, and test and friendly games can
/// be played.
#[utoipa::path(
    post, path = "/tournaments", tag = "organiser", security(("organiser" = [])), request_body = NewTournament,
    responses(
        (status = 201, body = TournamentView, headers(("Location" = String, description = "path of the tournament"))),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the name is taken, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn open_tournament(
    organiser: Organiser,
    State(app): State<App>,
    Body(request): Body<NewTournament>,
) -> Result<impl IntoResponse, Problem> {
    let opened = tournaments::open_tournament(&app, organiser.actor(), request).await?;
    let location = [(header::LOCATION, paths::tournament(opened.id))];
    let view = tournament::find(&app, opened.id).await?;
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

/// Changes a tournament: its rules until the first round starts, everything else until it is closed.
#[utoipa::path(
    patch, path = "/tournaments/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = TournamentChange,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "rules after the first round has started, any change after the tournament is closed, or the name is taken"),
        (status = 422),
    )
)]
pub(crate) async fn change_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(change): Body<TournamentChange>,
) -> Result<Json<TournamentView>, Problem> {
    tournaments::change_tournament(&app, organiser.actor(), id, change).await?;
    tournament::find(&app, id).await.map(Json)
}

/// Pauses a tournament: no game starts; running ones continue.
#[utoipa::path(
    post, path = "/tournaments/{id}/pause", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Reason,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "the tournament is already paused, or closed"),
        (status = 422),
    )
)]
pub(crate) async fn pause_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<TournamentView>, Problem> {
    tournaments::pause_tournament(&app, organiser.actor(), id, &reason).await?;
    tournament::find(&app, id).await.map(Json)
}

/// Resumes a paused tournament.
#[utoipa::path(
    post, path = "/tournaments/{id}/resume", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "the tournament is not paused, or is closed"),
    )
)]
pub(crate) async fn resume_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<TournamentView>, Problem> {
    tournaments::resume_tournament(&app, organiser.actor(), id).await?;
    tournament::find(&app, id).await.map(Json)
}

/// Closes a tournament for good: nothing of it can change any more.
#[utoipa::path(
    post, path = "/tournaments/{id}/close", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "not confirmed with its name (nothing is done), a game is unfinished or has to be rerun, or the tournament is already closed"),
    )
)]
pub(crate) async fn close_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<TournamentView>, Problem> {
    tournaments::close_tournament(&app, organiser.actor(), id, confirm.as_deref()).await?;
    tournament::find(&app, id).await.map(Json)
}
