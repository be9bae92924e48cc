//! The tournament: schedule, results of games, standings, and ratings of submissions.
//!
//! A game has 90 *windows* of 500 control steps. The penalty points of a team are counted for each window, like those of
//! an episode of the qualifying stage.

mod bye;
mod champion_shares;
mod departures;
mod game;
mod game_result;
mod game_score;
mod goal_difference;
mod head_to_head;
mod mirrored;
mod penalty_points;
pub mod rating;
mod rules;
pub mod schedule;
mod side;
mod standings;
mod submission_label;

pub use bye::{Bye, POINTS_BYE};
pub use champion_shares::{ChampionShare, compute_champion_shares};
pub use departures::{Departure, Departures, DuplicateDeparture};
pub use faceoff_types::{DepartureKind, InvalidRoundNumber, RoundNumber};
pub use game::{GameEntry, InvalidGame, PlayedGame, ScoredGame};
pub use game_result::{DrawReason, ForfeitKind, GameResult, ResultReason, WinReason};
pub use game_score::{GameScore, GameSettings, SideScore, score_game, window_penalty};
pub use goal_difference::{GoalDifference, MIN_FOR_INTERVAL};
pub use head_to_head::{HeadToHead, head_to_head};
pub use mirrored::{MirroredPairs, SubmissionPairing, VarianceComparison, find_mirrored_pairs};
pub use penalty_points::{
    EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS, MAX_EPISODE_PENALTY,
};
pub use rules::{
    FORFEIT_GOALS, GameTally, POINTS_DRAW, POINTS_LOSS, POINTS_WIN, final_score, forfeit_score,
    judge, winner,
};
pub use side::Side;
pub use standings::{
    RepeatedPairing, StandingsRow, Tournament, score_tournament, score_tournament_with,
};
pub use submission_label::{InvalidSubmissionLabel, SubmissionLabel};
