//! Operations of organisers, teams and workers on tournaments.

mod close;
pub(crate) mod entrants;
mod test_and_friendly_games;
pub(crate) mod open;
pub(crate) mod game_lifecycle;
mod current_entrants;
pub(crate) mod replays;
mod rounds;
mod rulings;
