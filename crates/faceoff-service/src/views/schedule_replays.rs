//! Replays of a tournament's schedule: repetitions of all its games with other seeds. The share of them that each team
//! wins estimates how certain the champion is.

use crate::{
    app::App,
    boxed_future,
    problem::Problem,
    views::{tournament::first_place, tournament_state::TournamentState},
};
use faceoff_api::views::champion_shares::ChampionSharesView;
use faceoff_scoring::tournament::compute_champion_shares;
use faceoff_store::{Game, GameFilter, GamePurpose, GameState};
use faceoff_types::{TeamName, TournamentId};
use std::{collections::BTreeMap, sync::Arc};

/// The shares, cached until the season changes. They are computed in a separate task, so that the result is cached even
/// if the client disconnects.
#[boxed_future]
pub async fn champion_shares(
    app: &App,
    id: TournamentId,
) -> Result<Arc<ChampionSharesView>, Problem> {
    let app = Arc::clone(app);
    let task = tokio::spawn(async move {
        let compute = compute(&app, id);
        app.tournament_answer(&app.champion_shares, id, compute)
            .await
    });
    task.await.map_err(Problem::internal)?
}

async fn compute(app: &App, id: TournamentId) -> Result<ChampionSharesView, Problem> {
    let state = TournamentState::find(app, id).await?;
    let games = app.store.games(id, GameFilter::ScheduleReplays).await?;
    // Every result is parsed and scored, which takes a while for a thousand replays.
    let shares = tokio::task::spawn_blocking(move || count_champions(&state, &games));
    shares.await.map_err(Problem::internal)?
}

fn count_champions(state: &TournamentState, games: &[Game]) -> Result<ChampionSharesView, Problem> {
    let mut replays = BTreeMap::<u32, Vec<&Game>>::new();
    for game in games {
        if let GamePurpose::ScheduleReplay { replay, .. } = game.purpose {
            replays.entry(replay).or_default().push(game);
        }
    }
    let mut champions = Vec::<TeamName>::new();
    let mut incomplete_count = 0;
    for games in replays.values() {
        // A replay is incomplete if one of its games has ended without a result.
        let (mut is_running, mut is_incomplete) = (false, false);
        for game in games {
            let is_played = matches!(game.state, GameState::Played(_));
            if !is_played && state.excluded_by(game)?.is_none() {
                is_running |= game.state.is_open();
                is_incomplete |= !game.state.is_open();
            }
        }
        if is_incomplete {
            incomplete_count += 1;
        } else if !is_running {
            let tables = state.tables(&state.results(games.iter().copied())?);
            champions.extend(tables.first().and_then(first_place));
        }
    }
    let played = games
        .iter()
        .filter(|game| matches!(game.state, GameState::Played(_)));
    let to_be_played = games
        .iter()
        .filter(|game| !matches!(game.state, GameState::Cancelled { .. }));
    Ok(ChampionSharesView {
        replays: to_u32(replays.len()),
        complete: to_u32(champions.len()),
        given_up: incomplete_count,
        games: to_u32(to_be_played.count()),
        games_played: to_u32(played.count()),
        champions: compute_champion_shares(&champions),
    })
}

fn to_u32(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
