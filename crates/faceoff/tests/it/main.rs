//! The program as a team calls it.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod compare;
mod dataset;
mod eval;
