//! Scoring against the published tables, and the properties that boards promise.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod boards;
mod comparison;
mod evaluation;
mod mirrored;
mod most_pairs;
mod pairing;
mod paper_qualifying;
mod paper_ratings;
mod paper_tournament;
mod ratings;
mod results;
mod schedule;
mod sheets;
mod support;
