//! Recordings of evaluations: the tables' schema, writing a shard as it is played, joining shards to a
//! dataset and scoring them, reading a dataset as a whole or by episode, and verifying it. The same of games,
//! which are recorded as a whole.
//!
//! This crate starts no process and knows neither sandbox nor database. It reads no clock: measured
//! times come from the caller or from the record.

mod archive_writer;
mod assemble;
mod dataset;
mod digest;
mod error;
mod files;
pub mod game;
mod granted_files;
mod interpolation_text;
mod recorder;
mod score;
mod shard;
mod shard_folder;
mod simulator;
mod table;
mod times;
pub mod verify;

pub use assemble::{Assembled, assemble};
pub use dataset::{Dataset, EpisodeRecord, Layout, StepBatches, StepTable};
pub use error::{DatasetError, RecordingError};
pub use files::{ARCHIVE_FILE, CLIPS_FILE};
pub use granted_files::files_of;
pub use recorder::Recorder;
pub use shard::ShardReport;
pub use shard_folder::{SHARD_FILES, ShardFolder};
pub use simulator::has_robot;
