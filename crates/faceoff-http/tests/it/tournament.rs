//! Tournaments in the API and on pages. A fake slot plays the games: it commits results to the real store as a slot does.

mod archive;
pub mod cup;
mod decisions;
mod downloads;
pub mod fake_slot;
mod formats;
mod game_page;
mod invalid_input;
mod live;
mod pages;
mod paper_results;
mod replays;
mod test_games;
