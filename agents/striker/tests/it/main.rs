//! Tests the agent over the evaluator's protocol, and in whole simulated episodes and games.

mod episodes;
mod games;
mod protocol;
#[path = "../support/mod.rs"]
mod support;
