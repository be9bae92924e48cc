//! Scoring of evaluations: outcomes of episodes → penalty points → tiers → boards; and of tournaments: games → standings
//! and ratings. Both with intervals and tests of differences.
//!
//! An *outcome* is the result of one simulated episode. *Penalty points* are for violated safety limits and late answers; an
//! agent's *tier* follows from them, if the competition has tiers. A *board* ranks evaluations, *standings* rank the teams of a
//! tournament. "The paper" in this crate is the report on the robot air hockey competition of 2023, whose rules these are.
//!
//! All functions are pure: a stored recording can be scored again without a simulation, and anyone can check a
//! published number. The rules are those of the rulesets of [`faceoff_types::Ruleset`]; `docs/rules.md` explains them.
//!
//! This crate reads no files, no clock and no random numbers, and it depends on neither the simulator nor the database.
//! Bootstraps draw from a hash of their input, schedules from a given seed.

#![warn(missing_docs)]

mod ablation;
mod binomial;
mod board;
mod comparison;
mod difference;
mod episode;
mod evaluation;
mod interval;
mod mean_result;
mod paired_tests;
mod qualifying;
mod random_numbers;
mod rank_groups;
mod solved_episodes;
mod step_times;
mod successes;
mod summary;
mod task;
mod tier;
mod tier_change;
pub mod tournament;
mod unique_map;

pub use ablation::{ProfileEffect, ablation};
pub use board::{BoardEntry, RankedEntry, overall_board, task_board};
pub use comparison::{
    ComparedEvaluation, Comparison, NotComparable, OverallComparison, TaskComparison,
};
pub use episode::{
    COMPUTATION_TIME_LIMITS_S, COMPUTATION_TIME_MAX_POINTS, COMPUTATION_TIME_MIN_POINTS,
    computation_time_penalty, episode_penalty,
};
pub use evaluation::{overall_score, score_evaluation};
pub use interval::{wilson95, wilson95_of_rate};
pub use mean_result::{joined_summary, mean_result};
pub use paired_tests::{PairedTally, PairingError, SIGNIFICANCE, overall_p_value};
pub use qualifying::{
    InvalidTaskScore, InvalidTasks, QUALIFYING_EPISODES, QualifyingRow, QualifyingScores, TaskRow,
    TaskScore,
};
pub use rank_groups::rank_groups;
pub use solved_episodes::SolvedEpisodes;
pub use step_times::StepTimes;
pub use successes::Successes;
pub use summary::{EpisodeSummary, TaskSummary};
pub use task::score_task;
pub use tier::{
    DEPLOYABLE_POINTS_PER_EPISODE, IMPROVABLE_POINTS_PER_EPISODE, TIER_BOUNDS, tier_of,
    tier_with_bounds,
};
pub use tier_change::TIER_CHANGE_RESAMPLES;
