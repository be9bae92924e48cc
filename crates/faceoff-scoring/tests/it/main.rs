//! Scoring compared with the published tables, and properties of boards, ratings and schedules.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod boards;
mod comparison;
mod evaluation;
mod input_files;
mod mirrored;
mod most_pairs;
mod pairing;
mod paper_qualifying;
mod paper_ratings;
mod paper_tournament;
mod ratings;
mod schedule;
mod support;
mod tournament_results;
