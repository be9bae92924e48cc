//! Tests of the runner with real archives, real agent processes in the sandbox, and real recordings.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod agents;
mod archives;
mod budget;
mod bundle;
mod live_feed;
mod dataset;
mod unread_questions;
mod fuzz;
mod game;
mod early_cpu_time;
mod host_interference;
mod interference_limits;
mod image;
mod image_agent;
mod image_archives;
mod misbehaviour;
mod recording;
mod shard;
mod supervision;
mod two_agents;
