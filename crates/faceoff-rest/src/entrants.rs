//! Who is in a tournament, and who leaves it.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Decision, NewDeparture, NewEntrants},
    views::tournament::TournamentView,
};
use faceoff_service::{
    acts::{deciding::checked_reason, entering},
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    views::{tournament, tournament_sheet::TournamentSheet},
};
use faceoff_store::{Actor, GameState, Leaving};
use faceoff_types::{LeftAs, TournamentId};
use std::slice;

/// Enters teams into a tournament.
#[utoipa::path(
    post, path = "/tournaments/{id}/entrants", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewEntrants,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "a team is in it or has left it, or no team can enter any more"),
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
    let sheet = TournamentSheet::unscored(&app, id).await?;
    let new = entering::named(&app, "teams", &teams).await?;
    entering::check_count(sheet.entrants.len() + new.len())?;
    let now = app.config.clock.now();
    app.store
        .enter_tournament(organiser.actor(), id, &new, now)
        .await?;
    tracing::info!(tournament = %id, teams = new.len(), "teams entered");
    tournament::find(&app, id).await.map(Json)
}

/// Takes a team out of a tournament for good: withdrawn, or disqualified. Its open games are called off; games with it
/// in the round that is under way, or between rounds in the next, count for nobody, those of finished rounds stay.
#[utoipa::path(
    post, path = "/tournaments/{id}/departures", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = NewDeparture,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), the team is not in it or has left, or it is closed"),
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
    if departure.from_round.is_some() && departure.r#as == LeftAs::Withdrawn {
        return Err(Problem::invalid(
            "from_round",
            "a team that withdraws keeps what it played in finished rounds; only of a disqualified one earlier rounds \
             are taken out",
        ));
    }
    let sheet = TournamentSheet::find(&app, id).await?;
    let team = entering::named(&app, "team", slice::from_ref(&departure.team)).await?[0];
    let leaving = Leaving {
        team,
        left_as: departure.r#as,
        from_round: departure.from_round,
        reason: reason.to_owned(),
    };
    check_confirmed(&sheet, &leaving, departure.confirm.as_deref())?;
    leave(&app, organiser.actor(), id, &leaving).await
}

/// Withdraws the caller's team from a tournament for good, as an organiser can do. By a member, not by a program.
#[utoipa::path(
    post, path = "/tournaments/{id}/withdrawal", tag = "team", security(("team" = [])),
    params(("id" = TournamentId, Path)), request_body = Decision,
    responses(
        (status = 200, body = TournamentView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), the team is not in it or has left, or it is closed"),
        (status = 422),
    )
)]
pub(crate) async fn withdraw_team(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Decision { reason, confirm }): Body<Decision>,
) -> Result<Json<TournamentView>, Problem> {
    let Some(team) = caller.team().filter(|_| caller.person().is_some()) else {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "a member of the team withdraws it, neither its programs nor organisers, who have POST \
             /api/v1/tournaments/ID/departures",
        ));
    };
    let reason = checked_reason(&reason)?;
    let sheet = TournamentSheet::find(&app, id).await?;
    let leaving = Leaving {
        team: team.id,
        left_as: LeftAs::Withdrawn,
        from_round: None,
        reason: reason.to_owned(),
    };
    check_confirmed(&sheet, &leaving, confirm.as_deref())?;
    leave(&app, caller.actor(), id, &leaving).await
}

/// Refuses what is not confirmed, and says what it would do.
fn check_confirmed(
    sheet: &TournamentSheet,
    leaving: &Leaving,
    confirm: Option<&str>,
) -> Result<(), Problem> {
    let entrants = &mut sheet.entrants.iter();
    let Some(entrant) = entrants.find(|one| one.team == leaving.team) else {
        return Err(Problem::new(
            ProblemKind::Conflict,
            format!("{} is not in the tournament", sheet.name(leaving.team)?),
        ));
    };
    let own = sheet
        .games
        .iter()
        .filter(|game| game.teams.contains(&leaving.team));
    let open = own.filter(|game| {
        !matches!(
            game.state,
            GameState::Played(_) | GameState::Cancelled { .. }
        )
    });
    if sheet.rounds.is_empty() {
        let what = format!(
            "{} would be out of the tournament, of which no round was started, and its test and friendly games that are \
             not over would be called off; it may enter again",
            entrant.name
        );
        return Problem::check_confirmed(confirm, entrant.name.as_str(), &what);
    }
    let how = match leaving.left_as {
        LeftAs::Withdrawn => "be withdrawn",
        LeftAs::Disqualified => "be disqualified, and stand below all others",
    };
    let earlier = match leaving.from_round {
        Some(round) => format!(", and of all rounds from {round} on,"),
        None => String::new(),
    };
    let what = format!(
        "{} would {how} for good; {} of its games, and its test and friendly games that are not over, would not be played, and games with it of the round that is under way or \
         next{earlier} count for nobody, with the reason {:?} for everybody to read",
        entrant.name,
        open.count(),
        leaving.reason
    );
    Problem::check_confirmed(confirm, entrant.name.as_str(), &what)
}

async fn leave(
    app: &App,
    actor: Actor,
    id: TournamentId,
    leaving: &Leaving,
) -> Result<Json<TournamentView>, Problem> {
    let now = app.config.clock.now();
    app.store.leave_tournament(actor, id, leaving, now).await?;
    tracing::info!(
        tournament = %id, team = %leaving.team, left_as = ?leaving.left_as, reason = leaving.reason, "team left"
    );
    tournament::find(app, id).await.map(Json)
}
