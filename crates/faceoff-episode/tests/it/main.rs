//! Episodes run from scripted answers.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod point_mass;
