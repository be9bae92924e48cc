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
    services::{decisions::checked_reason, entrants},
    views::{tournament, tournament_state::TournamentState},
};
use faceoff_store::{Actor, DepartureRequest, GameState};
use faceoff_types::{DepartureKind, TournamentId};
use std::slice;

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
    if teams.is_empty() {
        return Err(Problem::invalid(
            "teams",
            "expected at least one name, got none",
        ));
    }
    let state = TournamentState::without_standings(&app, id).await?;
    let new_entrants = entrants::find_by_names(&app, "teams", &teams).await?;
    entrants::check_count(state.entrants.len() + new_entrants.len())?;
    let now = app.config.clock.now();
    app.store
        .add_entrants(organiser.actor(), id, &new_entrants, now)
        .await?;
    tracing::info!(tournament = %id, teams = new_entrants.len(), "teams entered");
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
    let reason = checked_reason(&departure.reason)?;
    if departure.from_round.is_some() && departure.r#as == DepartureKind::Withdrawn {
        return Err(Problem::invalid(
            "from_round",
            "expected none for a withdrawal, got one; leave it out: finished rounds of a team that withdraws count",
        ));
    }
    let state = TournamentState::find(&app, id).await?;
    let team = entrants::find_by_names(&app, "team", slice::from_ref(&departure.team)).await?[0];
    let request = DepartureRequest {
        team,
        kind: departure.r#as,
        from_round: departure.from_round,
        reason: reason.to_owned(),
    };
    check_confirmed(&state, &request, departure.confirm.as_deref())?;
    leave(&app, organiser.actor(), id, &request).await
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
    let reason = checked_reason(&reason)?;
    let state = TournamentState::find(&app, id).await?;
    let request = DepartureRequest {
        team: team.id,
        kind: DepartureKind::Withdrawn,
        from_round: None,
        reason: reason.to_owned(),
    };
    check_confirmed(&state, &request, confirm.as_deref())?;
    leave(&app, caller.actor(), id, &request).await
}

/// Refuses a departure that is not confirmed with the team's name; the problem describes its effects.
fn check_confirmed(
    state: &TournamentState,
    departure: &DepartureRequest,
    confirm: Option<&str>,
) -> Result<(), Problem> {
    let entrants = &mut state.entrants.iter();
    let Some(entrant) = entrants.find(|entrant| entrant.team == departure.team) else {
        return Err(Problem::new(
            ProblemKind::Conflict,
            format!("{} is not in the tournament", state.name(departure.team)?),
        ));
    };
    let team_games = state
        .games
        .iter()
        .filter(|game| game.teams.contains(&departure.team));
    let open_games = team_games.filter(|game| {
        !matches!(
            game.state,
            GameState::Played(_) | GameState::Cancelled { .. }
        )
    });
    if state.rounds.is_empty() {
        let effect = format!(
            "{} would leave the tournament, whose first round has not started, and its unfinished test and friendly games \
             would be cancelled; it may enter again",
            entrant.name
        );
        return Problem::check_confirmed(confirm, entrant.name.as_str(), &effect);
    }
    if state.tournament.rules.plays_on(departure.kind) {
        let effect = format!(
            "{} would be withdrawn for good; its games of a running round would still be played and count, and it would not play in \
             later rounds; its unfinished test and friendly games would be cancelled; the reason {:?} would be public",
            entrant.name, departure.reason
        );
        return Problem::check_confirmed(confirm, entrant.name.as_str(), &effect);
    }
    let outcome = match departure.kind {
        DepartureKind::Withdrawn => "be withdrawn",
        DepartureKind::Disqualified => "be disqualified, and rank below all others",
    };
    let earlier_rounds = match departure.from_round {
        Some(round) => format!(", and of all rounds from {round} on"),
        None => String::new(),
    };
    let effect = format!(
        "{} would {outcome} for good; {} of its games, and its unfinished test and friendly games, would be cancelled; its games of \
         the running or next round{earlier_rounds} would not count; the reason {:?} would be public",
        entrant.name,
        open_games.count(),
        departure.reason
    );
    Problem::check_confirmed(confirm, entrant.name.as_str(), &effect)
}

async fn leave(
    app: &App,
    actor: Actor,
    id: TournamentId,
    departure: &DepartureRequest,
) -> Result<Json<TournamentView>, Problem> {
    let now = app.config.clock.now();
    app.store
        .leave_tournament(actor, id, departure, now)
        .await?;
    tracing::info!(
        tournament = %id, team = %departure.team, left_as = ?departure.kind, reason = departure.reason, "team left"
    );
    tournament::find(app, id).await.map(Json)
}
