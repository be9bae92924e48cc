//! The agent protocol as an agent's author meets it: every kind of answer, good and bad.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod answers;
mod robustness;
mod work;
