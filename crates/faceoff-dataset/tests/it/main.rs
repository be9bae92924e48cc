//! Tests of datasets through the public API: recordings of agents that are functions, forged and damaged recordings,
//! and recordings of earlier versions.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod assemble;
mod clips;
mod forgery;
mod game;
mod layout_2;
mod layout_3;
mod random_access;
mod recordings;
mod variation;
mod verify;
mod verify_shard;
