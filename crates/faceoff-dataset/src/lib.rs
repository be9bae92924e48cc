//! Recordings of evaluations and of games.
//!
//! An evaluation (one agent's run of all tasks) is recorded in *shards*, each a range of episodes of one task. This crate
//! records shards, joins them to a *dataset* and scores it, reads datasets completely or by episode, and verifies them by
//! simulating them again. Games are recorded and verified likewise, without shards.
//!
//! This crate starts no process and depends on neither sandbox nor database. It reads no clock: measured times come
//! from the caller or from the recording.

#![expect(
    clippy::result_large_err,
    reason = "a difference ends a verification, and holds the name of its task in place"
)]

mod archive_writer;
mod assemble;
mod conditions;
mod dataset;
mod digest;
mod error;
mod files;
pub mod game;
mod granted_files;
mod recorder;
mod score;
mod shard;
mod shard_folder;
mod simulator;
mod table;
mod times;
pub mod verify;

pub use assemble::{AssembledDataset, assemble};
pub use conditions::shard_conditions;
pub use dataset::{Dataset, EpisodeRecord, Layout, StepBatches, StepTable};
pub use error::{DatasetError, RecordingError};
pub use files::{ARCHIVE_FILE, CLIPS_FILE, allow_missing, max_file_bytes};
pub use granted_files::writable_files;
pub use recorder::Recorder;
pub use shard::ShardReport;
pub use shard_folder::{SHARD_FILES, ShardFolder};
