//! The agent over the protocol, and in whole simulated episodes.

mod episodes;
mod games;
mod protocol;
#[path = "../support/mod.rs"]
mod support;
