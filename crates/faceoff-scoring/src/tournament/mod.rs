//! The tournament: who wins a game, and how the standings follow from the games.
//!
//! In a round every team plays every other team once; a game is 90 windows of 500 control steps, and
//! each team's penalty points are counted window by window like the qualifying stage's episodes.

mod game;
mod rules;
mod standings;

pub use game::{InvalidGame, PlayedGame, ScoredGame};
pub use rules::{POINTS_DRAW, POINTS_LOSS, POINTS_WIN, Side, final_score, winner};
pub use standings::{RepeatedPairing, Standing, Tournament, score_tournament};
