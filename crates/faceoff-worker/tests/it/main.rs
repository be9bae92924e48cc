//! The worker as in a server: real store, real runner, real sandbox, and a Python agent.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod evaluations;
mod games;
mod games_killed;
mod kill;
mod killed_child;
mod server;
mod tournament;
