//! The runner as the platform uses it: real archives, real agent processes in the sandbox, real
//! recordings.
#![expect(clippy::unwrap_used, reason = "a helper's failure is its test's")]

mod agents;
mod archives;
mod budget;
mod bundle;
mod commentary;
mod dataset;
mod free_time;
mod fuzz;
mod game;
mod head_start;
mod host_noise;
mod host_share;
mod image;
mod image_agent;
mod image_archives;
mod misbehaviour;
mod recording;
mod shard;
mod supervision;
mod two_agents;
