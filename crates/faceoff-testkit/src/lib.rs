//! Shared setup of tests of several crates: a *store*, which is the database and files of a season, the steps that bring it to
//! the state that a test needs, and assertions about its answers. All of it panics where a step fails, as tests do.
#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests fail as tests do: by panicking"
)]

mod assertions;
mod outcomes;
mod stages;
mod stores;
mod submissions;
mod waiting;

pub use assertions::{assert_conflict, assert_contains};
pub use outcomes::{outcome, shard_commit, shard_outcomes};
pub use stages::{
    accept_runtimes, change_rules, change_settings, configure_stage, one_shard_plan,
    rules_and_settings, six_shard_plan, two_shard_plan,
};
pub use stores::new_store;
pub use submissions::{bundle_ref, create_team, finish_validation, submit, valid_outcome};
pub use waiting::{wait_for, wait_for_evaluation, wait_for_validation};
