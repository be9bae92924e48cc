//! Runs one agent over one shard of an evaluation: bundle → sandboxed process ⇄ JSON lines ⇄
//! simulator → recording and report; joins the shards of an evaluation to its dataset; and reads
//! datasets, to verify or to convert them.
//!
//! Two kinds of failure never mix: what the agent does wrong is an
//! [`AgentFault`](faceoff_types::AgentFault) inside of a report that succeeded, what fails on our
//! side is a [`PlatformFault`] and yields no report.
//!
//! This crate reads no environment variable and no configuration file, speaks no HTTP and knows no
//! database. It measures time around the agent's pipe, which is its job; all else that it computes
//! follows from the seeds.

mod assemble;
pub mod bundle;
mod calibration;
mod config;
mod cpu;
pub mod dataset;
mod fault;
mod host_noise;
mod host_watch;
mod log;
mod player;
mod recording;
mod seal;
mod session;
mod shard;
mod simulator;
mod smoke;
pub mod verify;

mod wire_env;

pub use assemble::{EvaluationMeta, assemble};
pub use config::{AgentEnvironment, TimeLimits};
pub use faceoff_episode::Answered;
pub use fault::PlatformFault;
pub use host_watch::HostWatch;
pub use session::{Session, Trouble};
pub use shard::{Observer, ShardReport, ShardSpec, run_shard, run_shard_watched};
pub use smoke::{SMOKE_STEPS, SmokeReport, smoke};
