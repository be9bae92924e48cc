//! Runs one agent over one shard of an evaluation, or two agents through a game: bundle → sandboxed
//! process ⇄ JSON lines ⇄ simulator → recording and report.
//!
//! Two kinds of failure never mix: what the agent does wrong is an
//! [`AgentFault`](faceoff_types::AgentFault) inside of a report that succeeded, what fails on our
//! side is a [`PlatformFault`] and yields no report.
//!
//! This crate reads no environment variable and no configuration file, speaks no HTTP and knows no
//! database. It measures time around the agent's channel, which is its job; all else that it computes
//! follows from the seeds.

mod budget;
pub mod bundle;
mod calibration;
mod config;
mod cpu_use;
mod exchange;
mod fault;
mod game;
mod host_watch;
mod inventory;
mod log;
mod player;
mod session;
mod shard;
mod smoke;
mod supervisor;
mod waited;
mod wire_env;

pub use config::AgentEnvironment;
pub use faceoff_dataset::{Assembled, CLIPS_FILE, ShardReport, assemble, game::GameArchives};
pub use faceoff_types::TimeLimits;
pub use faceoff_wire::game::{GameCalibration, GameSpec};
pub use faceoff_wire::work::{EvaluationMeta, ShardSpec, SmokeSpec};
pub use fault::{PlatformFault, Trouble};
pub use game::{
    Commentary, GameAudience, GameObserver, GameReport, POSITION_EVERY, play_game, run_game,
    run_game_watched,
};
pub use host_watch::{Counters, HostWatch};
pub use inventory::inventory;
pub use session::Session;
pub use shard::{Observer, play_shard, run_shard, run_shard_watched};
pub use smoke::{SMOKE_STEPS, SmokeDefect, SmokeReport, smoke, smoke_watched};
pub use supervisor::{Supervision, standing_still};
pub use waited::Waited;
