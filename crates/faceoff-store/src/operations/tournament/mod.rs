//! Operations of organisers, teams and workers on tournaments.

mod close;
mod current_entrants;
pub(crate) mod entrants;
pub(crate) mod game_lifecycle;
pub(crate) mod open;
pub(crate) mod replays;
mod rounds;
mod rulings;
mod test_and_friendly_games;
