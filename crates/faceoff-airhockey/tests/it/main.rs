//! Episodes and games of air hockey run from scripted answers.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod episode;
mod game;
