//! Workers and the daily schedule. A *worker* is a process that runs jobs (validation runs, shards of evaluations, games,
//! scorings). It has *slots*, each of which runs one job at a time: the slot leases a job, runs its agents through
//! `faceoff-runner` and commits the result. A slot gets its jobs (`faceoff-wire`) through the trait `JobServer`, and
//! their files through the trait `FileStore`, in the modules `server` and `files`. `local` and `local_files` implement them on the
//! store, for slots in the server's own process; `remote` over the network, for workers on other machines.
//!
//! A slot is a named operating-system thread: physics and the agent's pipes block, so they must not share a thread with
//! the server's async tasks. A job is leased for seconds and the lease is renewed while the job runs, so another slot
//! takes over when a slot dies. A platform fault releases the job. Only the runner's verdicts are stored as agent
//! faults.
//!
//! This crate makes no decisions about physics, protocol or scores. Its state is in the store, so a kill loses nothing.

mod ablation_clips;
mod bundle_cache;
mod cleanup;
mod cpus;
mod episode_summaries;
mod evaluator;
mod executor;
mod files;
mod full_disk;
mod game_broadcast;
mod lease;
mod local;
mod local_files;
mod remote;
mod schedule;
mod scorer;
mod scratch;
mod server;
mod slot;
mod slot_supervisor;
mod slot_threads;
#[cfg(test)]
mod tests;

/// `#[boxed_future]` on a public `async fn` makes it return a boxed future, so that its body is compiled once, here, and not in each
/// crate that awaits it.
pub(crate) use async_recursion::async_recursion as boxed_future;

pub use cleanup::clean_up;
pub use cpus::{CpuLayout, SlotCpus};
pub use remote::{
    BucketConfig, ConnectionCheck, NatsConfig, RemoteConfig, RemoteWorkerConfig, check_connection,
    dispatch, run_remote_worker,
};
pub use schedule::{run_schedule, update_due_days};
pub use slot_supervisor::{SlotsConfig, WorkerConfig, run};
pub use slot_threads::{SlotStarter, SlotThreads};
