//! What organisers, teams and slots do in tournaments.

mod close;
pub(crate) mod entrants;
mod free_games;
pub(crate) mod open;
pub(crate) mod play;
mod playing;
pub(crate) mod replays;
mod rounds;
mod rulings;
