//! Operations of organisers, teams and workers on tournaments.

mod close_tournament;
mod current_entrants;
pub(crate) mod entrants;
mod game_decisions;
pub(crate) mod game_lifecycle;
pub(crate) mod open_tournament;
mod rounds;
pub(crate) mod schedule_replays;
mod test_and_friendly_games;
