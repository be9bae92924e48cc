//! The part of the server that works: slots lease units of work, run agents through `faceoff-runner`,
//! and commit what came of it; and the daily schedule. A slot gets a work order (`faceoff-wire`) from
//! a server that it knows as a trait; that of its own process sits on the store.
//!
//! A slot is a named operating-system thread: physics and the agent's pipes block, and must not share
//! a thread with the service's async tasks. A unit is leased for seconds and renewed while it runs,
//! so that the work of a slot that died is done by another. A fault of ours gives the unit back; only
//! the runner's verdicts on the agent are stored as the agent's.
//!
//! This crate decides nothing about physics, protocol or scores, and holds no state that a kill would
//! lose: everything is in the store.

mod ablation_clips;
mod bundle_cache;
mod cpus;
mod evaluator;
mod executor;
mod full_disk;
mod lease;
mod local;
mod remote;
mod schedule;
mod scratch;
mod server;
mod service;
mod shown;
mod slot;
mod slot_threads;
#[cfg(test)]
mod tests;
mod tidying;

/// What others await is boxed, so that it is compiled here, once, and not by each crate that awaits it.
pub(crate) use async_recursion::async_recursion as boxed;

pub use cpus::{CpuLayout, SlotCpus};
pub use remote::{
    BucketConfig, Examined, NatsConfig, RemoteConfig, RemoteWorker, dispatch, examine, work,
};
pub use schedule::{run_schedule, start_due};
pub use service::{SlotsConfig, WorkerConfig, run};
pub use slot_threads::{SlotStarter, SlotThreads};
pub use tidying::tidy;
