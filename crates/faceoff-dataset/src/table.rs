//! The two tables, control steps and episodes: their columns, their rows, their files.

mod columns;
mod episodes;
mod join;
mod steps;
mod writer;

pub(crate) use episodes::EpisodeRows;
pub(crate) use join::{ShardTable, join};
pub(crate) use steps::{CONSTRAINTS, HOST_TIME, StepRows, without_host_time};
pub(crate) use writer::TableWriter;
