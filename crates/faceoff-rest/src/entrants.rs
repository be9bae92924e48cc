//! Entrants, the teams of a tournament: entering them, withdrawing and disqualifying them.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Decision, NewDeparture, NewEntrants},
    views::tournament::TournamentView,
};
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    services::{
        departures::{self, PlannedDeparture},
        entrants,
    },
    views::tournament,
};
use faceoff_types::{DepartureKind, TournamentId};

/// Enters teams into a tournament.
#[utoipa::path(
    post, path = "/tournaments/{id}/entrants", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewEntrants,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "a team has already entered or left, or the tournament accepts no more teams"),
        (status = 422),
    )
)]
pub(crate) async fn enter_teams(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(NewEntrants { teams }): Body<NewEntrants>,
) -> Result<Json<TournamentView>, Problem> {
    entrants::enter_teams(&app, organiser.actor(), id, &teams).await?;
    tournament::find(&app, id).await.map(Json)
}

/// Withdraws or disqualifies a team from a tournament, for good.
///
/// Its open games are cancelled. Its games of the running round, or of the next one between rounds, do not count; those
/// of finished rounds do.
#[utoipa::path(
    post, path = "/tournaments/{id}/departures", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewDeparture,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), the team has not entered or has left, or the tournament is closed"),
        (status = 422),
    )
)]
pub(crate) async fn depart(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(departure): Body<NewDeparture>,
) -> Result<Json<TournamentView>, Problem> {
    departures::leave_by_name(&app, organiser.actor(), id, &departure).await?;
    tournament::find(&app, id).await.map(Json)
}

/// Withdraws the caller's team from a tournament, for good. Needs a member's token, not the team's.
#[utoipa::path(
    post, path = "/tournaments/{id}/withdrawal", tag = "team", security(("team" = [])),
    params(("id" = TournamentId, Path)), request_body = Decision,
    responses(
        (status = 200, body = TournamentView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), the team has not entered or has left, or the tournament is closed"),
        (status = 422),
    )
)]
pub(crate) async fn withdraw_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Decision { reason, confirm }): Body<Decision>,
) -> Result<Json<TournamentView>, Problem> {
    let Some(team) = caller.team().filter(|_| caller.user().is_some()) else {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "only a member of the team can withdraw it; organisers use POST /api/v1/tournaments/ID/departures",
        ));
    };
    let planned = PlannedDeparture {
        team: team.id,
        kind: DepartureKind::Withdrawn,
        from_round: None,
        reason: Some(&reason),
    };
    departures::leave_tournament(&app, caller.actor(), id, &planned, confirm.as_deref()).await?;
    tournament::find(&app, id).await.map(Json)
}
