//! Departures of teams from a tournament: a team withdraws, or organisers withdraw or disqualify it.

use super::decisions::{Preview, checked_reason};
use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    views::tournament_state::TournamentState,
};
use faceoff_store::{Actor, DepartureRequest, GameState};
use faceoff_types::{DepartureKind, RoundNumber, TeamId, TournamentId};

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

/// A clause for the description of effects.
fn reason_clause(reason: Option<&str>) -> String {
    match reason {
        Some(reason) => format!("the reason {reason:?} would be public"),
        None => "the reason would be public".to_owned(),
    }
}

/// Preview of a departure.
#[boxed]
pub async fn preview_departure(
    app: &AppState,
    id: TournamentId,
    departure: &PlannedDeparture<'_>,
) -> Result<Preview, Problem> {
    let state = TournamentState::without_standings(app, id).await?;
    let entrants = &mut state.entrants.iter();
    let Some(entrant) = entrants.find(|entrant| entrant.team == departure.team) else {
        return Err(Problem::new(
            ProblemKind::Conflict,
            format!("{} is not in the tournament", state.name(departure.team)?),
        ));
    };
    let name = entrant.name.to_string();
    let preview = |effect| Preview { name, effect };
    let reason = reason_clause(departure.reason);
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
        return Ok(preview(effect));
    }
    if state.tournament.rules.plays_on(departure.kind) {
        let effect = format!(
            "{} would be withdrawn for good; its games of a running round would still be played and count, and it would not play in \
             later rounds; its unfinished test and friendly games would be cancelled; {reason}",
            entrant.name
        );
        return Ok(preview(effect));
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
         the running or next round{earlier_rounds} would not count; {reason}",
        entrant.name,
        open_games.count()
    );
    Ok(preview(effect))
}

/// Lets a team leave a tournament for good, if that is confirmed with the team's name.
#[boxed]
pub async fn leave_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    departure: &PlannedDeparture<'_>,
    confirm: Option<&str>,
) -> Result<(), Problem> {
    let reason = checked_reason(departure.reason.unwrap_or_default())?;
    let departure = PlannedDeparture {
        reason: Some(reason),
        ..*departure
    };
    let preview = preview_departure(app, id, &departure).await?;
    preview.check_confirmed(confirm)?;
    let PlannedDeparture {
        team,
        kind,
        from_round,
        ..
    } = departure;
    let request = DepartureRequest {
        team,
        kind,
        from_round,
        reason: reason.to_owned(),
    };
    let now = app.config.clock.now();
    app.store.leave_tournament(actor, id, &request, now).await?;
    tracing::info!(tournament = %id, %team, left_as = ?kind, reason, "team left");
    Ok(())
}
