//! Tournaments in the API and on pages. A fake slot plays the games: it commits results to the real store as a slot does.

mod archive;
pub mod cup;
mod downloads;
mod formats;
mod test_games;
mod game_page;
mod live;
mod pages;
mod paper_results;
mod replays;
mod decisions;
pub mod fake_slot;
mod invalid_input;
