//! Departures of teams from a tournament: a team withdraws, or organisers withdraw or disqualify it.

use super::{
    decision_preview::{Preview, checked_reason, reason_sentence},
    entrants,
};
use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    views::tournament_state::TournamentState,
};
use faceoff_api::requests::NewDeparture;
use faceoff_store::{Actor, DepartureRequest, GameState};
use faceoff_types::{DepartureKind, RoundNumber, TeamId, TournamentId};
use std::slice;

/// Which team leaves a tournament, and how.
#[derive(Debug, Clone, Copy)]
pub struct PlannedDeparture<'a> {
    pub team: TeamId,
    pub kind: DepartureKind,
    /// For a disqualified team: the first round whose games do not count. Default: the running round, or the next one.
    pub from_round: Option<RoundNumber>,
    /// `None` before an organiser has written it.
    pub reason: Option<&'a str>,
}

/// Preview of a departure.
#[boxed_future]
pub async fn preview_departure(
    app: &AppState,
    id: TournamentId,
    departure: &PlannedDeparture<'_>,
) -> Result<Preview, Problem> {
    preview(&TournamentState::find(app, id).await?, departure)
}

fn preview(state: &TournamentState, departure: &PlannedDeparture<'_>) -> Result<Preview, Problem> {
    let entrants = &mut state.entrants.iter();
    let Some(entrant) = entrants.find(|entrant| entrant.team == departure.team) else {
        return Err(Problem::new(
            ProblemKind::Conflict,
            format!(
                "the team {} is not in the tournament",
                state.name(departure.team)?
            ),
        ));
    };
    let name = entrant.name.to_string();
    let reason = reason_sentence(departure.reason);
    let effect = if state.rounds.is_empty() {
        let consequence = match departure.kind {
            DepartureKind::Withdrawn => "It may enter again",
            DepartureKind::Disqualified => {
                "Before the first round a disqualification only removes the team, like a withdrawal: it may enter again"
            }
        };
        format!(
            "the team {name} will leave the tournament, whose first round has not started. Its unfinished test and friendly games \
             will be cancelled. {consequence}"
        )
    } else if state.tournament.rules.finishes_round(departure.kind) {
        format!(
            "the team {name} will be withdrawn for good. Its games of a running round will still be played and count, but it will not \
             play in later rounds. Its unfinished test and friendly games will be cancelled. {reason}"
        )
    } else {
        let (outcome, rank) = match departure.kind {
            DepartureKind::Withdrawn => ("withdrawn", ""),
            DepartureKind::Disqualified => ("disqualified", " and will rank below all others"),
        };
        let earlier_rounds = match departure.from_round {
            Some(round) => format!(", and of all rounds from {round} on,"),
            None => String::new(),
        };
        let open_games = state.games.iter().filter(|game| {
            game.teams.contains(&departure.team)
                && !matches!(
                    game.state,
                    GameState::Played(_) | GameState::Cancelled { .. }
                )
        });
        format!(
            "the team {name} will be {outcome} for good{rank}. {} of its games, and its unfinished test and friendly games, will be \
             cancelled. Its games of the running or next round{earlier_rounds} will not count. {reason}",
            open_games.count()
        )
    };
    Ok(Preview { name, effect })
}

/// Lets a team leave a tournament for good, if that is confirmed with the team's name.
#[boxed_future]
pub async fn leave_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    departure: &PlannedDeparture<'_>,
    confirm: Option<&str>,
) -> Result<(), Problem> {
    let reason = checked_reason(departure.reason.unwrap_or_default())?;
    let state = TournamentState::find(app, id).await?;
    let departure = PlannedDeparture {
        reason: Some(reason),
        ..*departure
    };
    preview(&state, &departure)?.check_confirmed(confirm)?;
    record_departure(app, actor, id, request(&departure, reason)).await
}

/// Lets the team with the name in the request leave a tournament, like [`leave_tournament`].
#[boxed_future]
pub async fn leave_by_name(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    departure: &NewDeparture,
) -> Result<(), Problem> {
    let reason = checked_reason(&departure.reason)?;
    if departure.from_round.is_some() && departure.kind == DepartureKind::Withdrawn {
        return Err(Problem::invalid(
            "from_round",
            "expected none for a withdrawal, got one; leave it out: finished rounds of a team that withdraws count",
        ));
    }
    let state = TournamentState::find(app, id).await?;
    let team = entrants::find_by_names(app, "team", slice::from_ref(&departure.team)).await?[0];
    let planned = PlannedDeparture {
        team,
        kind: departure.kind,
        from_round: departure.from_round,
        reason: Some(reason),
    };
    preview(&state, &planned)?.check_confirmed(departure.confirm.as_deref())?;
    record_departure(app, actor, id, request(&planned, reason)).await
}

fn request(departure: &PlannedDeparture<'_>, reason: &str) -> DepartureRequest {
    DepartureRequest {
        team: departure.team,
        kind: departure.kind,
        from_round: departure.from_round,
        reason: reason.to_owned(),
    }
}

async fn record_departure(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    request: DepartureRequest,
) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.leave_tournament(actor, id, &request, now).await?;
    tracing::info!(
        tournament = %id, team = %request.team, left_as = ?request.kind, reason = request.reason, "team left"
    );
    Ok(())
}
