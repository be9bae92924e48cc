//! Who is in a tournament, and what they are owed.

use crate::{
    error::Result,
    tables::{
        entrants::{self, Entrant},
        games::{Game, GameState},
    },
    write::Tx,
};
use faceoff_types::{TeamId, TournamentId};

/// Those that are in a tournament.
pub(super) async fn playing(tx: &mut Tx, id: TournamentId) -> Result<Vec<Entrant>> {
    let mut all = entrants::all(tx, id).await?;
    all.retain(|entrant| entrant.left.is_none());
    Ok(all)
}

/// The games of rounds that have no result and can still get one: neither of their teams has left.
pub(super) fn owed<'a>(games: &'a [Game], playing: &[Entrant]) -> Vec<&'a Game> {
    let plays = |team: &TeamId| playing.iter().any(|entrant| entrant.team == *team);
    games
        .iter()
        .filter(|game| !matches!(game.state, GameState::Played(_)) && game.teams.iter().all(plays))
        .collect()
}
