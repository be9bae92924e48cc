//! Runs one agent over a *shard* (a range of episodes of an evaluation), or two agents through a game: bundle → sandboxed process ⇄
//! JSON lines ⇄ simulator → recording and report.
//!
//! Agent faults and platform faults never mix. An agent fault is an
//! [`AgentFault`](faceoff_types::AgentFault) inside a successful report. A platform fault is a
//! [`PlatformFault`] and yields no report.
//!
//! This crate reads no environment variable and no configuration file, speaks no HTTP and uses no
//! database. It measures time around the agent's channel; all other results follow from the seeds.

pub mod bundle;
mod calibration;
mod config;
mod cpu_usage;
mod exchange;
mod fault;
mod game;
mod host_interference;
mod inventory;
mod log;
mod player;
mod session;
mod shard;
mod supervisor;
mod time_budget;
mod validation;
mod wait_breakdown;

pub use config::AgentEnvironment;
pub use faceoff_dataset::{
    AssembledDataset, CLIPS_FILE, ShardReport, assemble, game::GameArchives,
};
pub use faceoff_types::TimeLimits;
pub use faceoff_wire::game::{GameCalibration, GameSpec};
pub use faceoff_wire::job::{EvaluationMeta, ShardSpec, ValidationSpec};
pub use fault::{PlatformFault, SessionError};
pub use game::{
    GameObserver, GameReport, LiveFeed, LiveFeedSink, POSITION_INTERVAL, play_game, run_game,
    run_game_monitored,
};
pub use host_interference::{InterferenceMonitor, KernelCounters};
pub use inventory::take_inventory;
pub use session::Session;
pub use shard::{Observer, play_shard, run_shard, run_shard_monitored};
pub use supervisor::{Supervision, stuck_threads};
pub use validation::{
    VALIDATION_STEPS, ValidationFailure, ValidationReport, validate, validate_monitored,
};
pub use wait_breakdown::WaitBreakdown;
