//! The tournament: who meets whom, who wins a game and why, how the standings follow from the games, and
//! how strong the submissions are.
//!
//! In a round every team plays every other team once; a game is 90 windows of 500 control steps, and
//! each team's penalty points are counted window by window like the qualifying stage's episodes.

mod bye;
mod certainty;
mod departures;
mod game;
mod goal_difference;
mod head_to_head;
mod mirrored;
pub mod rating;
mod result;
mod rules;
pub mod schedule;
mod score;
mod side;
mod standings;
mod submission_label;

pub use bye::{Bye, POINTS_BYE};
pub use certainty::{ChampionShare, champions};
pub use departures::{Departure, Departures, LeavesTwice};
pub use faceoff_types::{InvalidRoundNumber, LeftAs, RoundNumber};
pub use game::{GameEntry, InvalidGame, PlayedGame, ScoredGame};
pub use goal_difference::{GoalDifference, MIN_FOR_INTERVAL};
pub use head_to_head::{HeadToHead, head_to_head};
pub use mirrored::{MirroredPairs, Pairing, Spread, mirrored};
pub use result::{DrawnBy, Forfeit, GameResult, Why, WonBy};
pub use rules::{
    FORFEIT_GOALS, GameFacts, POINTS_DRAW, POINTS_LOSS, POINTS_WIN, final_score, forfeit_score,
    judge, winner,
};
pub use score::{GameScore, PlayedAs, SideScore, score_game, window_penalty};
pub use side::Side;
pub use standings::{
    RepeatedPairing, Standing, Tournament, score_tournament, score_tournament_with,
};
pub use submission_label::{InvalidSubmissionLabel, SubmissionLabel};
