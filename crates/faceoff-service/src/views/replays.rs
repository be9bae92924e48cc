//! The schedule of a tournament, played again with fresh seeds: who would have been its champion.

use crate::{
    app::App,
    boxed,
    problem::Problem,
    views::{tournament::first_place, tournament_sheet::TournamentSheet},
};
use faceoff_api::views::certainty::CertaintyView;
use faceoff_scoring::tournament::champions;
use faceoff_store::{Game, GamePurpose, GameState, GamesOf};
use faceoff_types::{TeamName, TournamentId};
use std::{collections::BTreeMap, sync::Arc};

/// As it was worked out since the newest change of the season. In a task of its own, so that who asks and goes does
/// not have it worked out for nobody.
#[boxed]
pub async fn certainty(app: &App, id: TournamentId) -> Result<Arc<CertaintyView>, Problem> {
    let app = Arc::clone(app);
    let task = tokio::spawn(async move {
        let make = async || make(&app, id).await;
        app.certainties.get(&app.store, id, make).await
    });
    task.await.map_err(Problem::internal)?
}

async fn make(app: &App, id: TournamentId) -> Result<CertaintyView, Problem> {
    let sheet = TournamentSheet::find(app, id).await?;
    let games = app.store.games(id, GamesOf::Replays).await?;
    // Each result is read and scored: of a thousand replays that is some work.
    let made = tokio::task::spawn_blocking(move || of(&sheet, &games));
    made.await.map_err(Problem::internal)?
}

fn of(sheet: &TournamentSheet, games: &[Game]) -> Result<CertaintyView, Problem> {
    let mut replays = BTreeMap::<u32, Vec<&Game>>::new();
    for game in games {
        if let GamePurpose::Replay { replay, .. } = game.purpose {
            replays.entry(replay).or_default().push(game);
        }
    }
    let mut first_places = Vec::<TeamName>::new();
    let mut given_up = 0;
    for of_replay in replays.values() {
        let (mut awaits, mut lacks) = (false, false);
        for game in of_replay {
            let is_played = matches!(game.state, GameState::Played(_));
            if !is_played && sheet.taken_out_by(game)?.is_none() {
                awaits |= game.state.is_open();
                lacks |= !game.state.is_open();
            }
        }
        if lacks {
            given_up += 1;
        } else if !awaits {
            let tables = sheet.tables(&sheet.results(of_replay.iter().copied())?);
            first_places.extend(tables.first().and_then(first_place));
        }
    }
    let played = games
        .iter()
        .filter(|game| matches!(game.state, GameState::Played(_)));
    let to_be_played = games
        .iter()
        .filter(|game| !matches!(game.state, GameState::Cancelled { .. }));
    Ok(CertaintyView {
        replays: count(replays.len()),
        complete: count(first_places.len()),
        given_up,
        games: count(to_be_played.count()),
        games_played: count(played.count()),
        champions: champions(&first_places),
    })
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
