//! Tests of tournaments in the API and on pages. A fake slot runs the games: it takes jobs from the real store and commits
//! made-up results, as a worker's slot does with real ones. `cup` and `fake_worker` have helpers, the other modules the tests.

mod archive;
pub mod cup;
mod decisions;
mod downloads;
pub mod fake_worker;
mod formats;
mod game_page;
mod invalid_input;
mod live;
mod organiser_pages;
mod pages;
mod paper_results;
mod schedule_replays;
mod test_games;
