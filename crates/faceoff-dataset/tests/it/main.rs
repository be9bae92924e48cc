//! Datasets as others meet them: recorded by the library from agents that are functions, forged,
//! damaged, and made by the version before.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod assemble;
mod by_index;
mod clips;
mod forgery;
mod game;
mod layout_2;
mod layout_3;
mod played;
mod variation;
mod verify;
mod verify_shard;
