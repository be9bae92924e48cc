//! What Faceoff remembers: teams, submissions, evaluations, shards and the queue of work in SQLite,
//! bundles, recordings and datasets as artifacts in an object store.
//!
//! One module per entity; SQL stays in here. Every function that changes something is one
//! transaction, so that a process killed at any point leaves either all of it or nothing. The store
//! runs no agent, computes no score and reads no clock: instants are passed in. Per-step data never
//! enters the database.
//!
//! # Durability
//! Write-ahead log with `synchronous = FULL`: what a function has returned survives `kill -9` and a
//! power cut. SQLite has one writer, so there is one write connection, and every transaction on it
//! begins IMMEDIATE: it waits for another process's writer instead of failing half way.
//!
//! # Queries
//! All SQL is checked at compile time. `.sqlx/` at the workspace root holds what the check needs
//! without a database; after a change of SQL or of a migration run `crates/faceoff-store/prepare.sh`
//! (`--check` compares instead of writing).

mod ablations;
mod artifacts;
mod board;
mod column;
mod database;
mod error;
mod evaluation_ends;
mod evaluations;
mod events;
mod leases;
mod plan;
mod queue;
mod releases;
mod schedule;
mod season;
mod shards;
mod smoke_runs;
mod store;
mod submissions;
mod summaries;
mod teams;

pub use ablations::{Ablation, AblationRun, AblationState};
pub use artifacts::{ArtifactStream, Artifacts};
pub use board::BoardRecord;
pub use error::StoreError;
pub use evaluations::{Evaluation, EvaluationState};
pub use events::Event;
pub use faceoff_types::{BundleRef, SmokeOutcome};
pub use leases::{Claim, Committed};
pub use plan::EvaluationPlan;
pub use queue::{MAX_ATTEMPTS, MAX_LEASES, Work};
pub use releases::DaySeed;
pub use season::Season;
pub use shards::{Shard, ShardCommit};
pub use store::Store;
pub use submissions::{Submission, SubmissionState};
pub use teams::Team;
