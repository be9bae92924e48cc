//! Episodes played from answers that are given here.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod course;
mod game;
