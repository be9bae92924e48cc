//! Starting the next round of a tournament. A round has *matchdays*, in each of which a team plays one game or has a bye; who
//! plays whom is drawn from the results so far.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    views::tournament_state::TournamentState,
};
use faceoff_scoring::tournament::schedule::{Matchday, Round};
use faceoff_store::{Actor, DrawnMatchday, DrawnRound, TournamentRound};
use faceoff_types::{RoundNumber, TeamId, TeamName, TournamentId};

fn conflict(detail: String) -> Problem {
    Problem::new(ProblemKind::Conflict, detail)
}

/// Refuses to start a round that is not the next one after the `started` rounds.
///
/// # Errors
/// `Conflict`.
pub fn check_next_round(number: RoundNumber, started: usize) -> Result<(), Problem> {
    if number.index() == started {
        return Ok(());
    }
    Err(conflict(match number.index() < started {
        true => format!(
            "round {number} has started already; open the page of the tournament, which shows its games"
        ),
        false => format!(
            "expected the number of the next round, {}, got {number}; open the page of the tournament",
            started + 1
        ),
    }))
}

/// Draws and starts the next round. The store refuses the draw if another request has started the round meanwhile.
///
/// # Errors
/// `Conflict` if the next round has not the number `expected`, or cannot start.
#[boxed_future]
pub async fn start_round(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    expected: Option<RoundNumber>,
) -> Result<TournamentRound, Problem> {
    let state = TournamentState::find(app, id).await?;
    if state.tournament.closed_at.is_some() {
        return Err(conflict(
            "the tournament is closed; no further round starts".to_owned(),
        ));
    }
    if let Some(number) = expected {
        check_next_round(number, state.rounds.len())?;
    }
    // In a mirrored tournament each pairing is played twice with exchanged sides. The scoring would also accept one of the two
    // games, so the draw waits until both have a result.
    let open_games = state.games.iter().filter(|game| state.needs_result(game));
    let open_count = open_games.count();
    if open_count > 0 {
        let round = state.rounds.len();
        return Err(conflict(format!(
            "round {round} is running: {open_count} of its games have no result, and the next round is drawn from all results. \
             Wait, rerun void and failed games (POST /api/v1/games/ID/rerun), or withdraw a team"
        )));
    }
    let secret = app.store.season().await?.secret;
    let next_round = state
        .next_round(&secret)
        .map_err(|error| conflict(error.to_string()))?;
    let Some(next_round) = next_round else {
        return Err(conflict(format!(
            "all {} rounds of the tournament are over; close it, or create another one",
            state.rounds.len()
        )));
    };
    let round = with_team_ids(&state, &next_round)?;
    let now = app.config.clock.now();
    Ok(app.store.start_round(actor, id, &round, now).await?)
}

/// The round with team ids in place of names.
fn with_team_ids(state: &TournamentState, round: &Round) -> Result<DrawnRound, Problem> {
    let ids = |names: &Vec<TeamName>| -> Result<Vec<TeamId>, Problem> {
        names.iter().map(|name| state.team(name)).collect()
    };
    let matchday = |day: &Matchday| {
        let games = day
            .pairings
            .iter()
            .map(|pairing| Ok([state.team(&pairing.home)?, state.team(&pairing.away)?]));
        Ok::<_, Problem>(DrawnMatchday {
            games: games.collect::<Result<_, Problem>>()?,
            byes: ids(&day.byes)?,
        })
    };
    Ok(DrawnRound {
        number: round.number,
        groups: round.groups.iter().map(ids).collect::<Result<_, _>>()?,
        matchdays: round
            .matchdays
            .iter()
            .map(matchday)
            .collect::<Result<_, _>>()?,
    })
}
