//! Tournaments over HTTP: opened, drawn, played by a stand-in for the slots, ruled over, watched and downloaded. Results
//! are committed to the real store as a slot does.

mod archived;
pub mod cup;
mod files;
mod formats;
mod free_games;
mod game_page;
mod live;
mod pages;
mod paper;
mod replays;
mod rulings;
pub mod slot;
mod wrong;
