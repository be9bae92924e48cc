//! Tests of the runner with real archives, real agent processes in the sandbox, and real recordings.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod agents;
mod archives;
mod bundle;
mod dataset;
mod early_cpu_time;
mod fuzz;
mod game;
mod host_interference;
mod image;
mod image_agent;
mod image_archives;
mod interference_limits;
mod live_feed;
mod misbehaviour;
mod recording;
mod shard;
mod supervision;
mod two_agents;
mod unpacking;
mod unpacking_budget;
mod unread_questions;
