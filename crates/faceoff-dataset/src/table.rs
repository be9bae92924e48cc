//! The tables: of an evaluation control steps and episodes, and those of a game: their columns, their rows, their files.

mod columns;
mod episodes;
mod game;
mod join;
mod steps;
mod writer;

pub(crate) use episodes::EpisodeRows;
pub(crate) use game::{EntryRows, MotionRows, RallyRows, SIDE_TIMES, SideRows};
pub(crate) use join::{ShardTable, join};
pub(crate) use steps::{CONSTRAINTS, HOST_TIME, StepRows, without_host_time};
pub(crate) use writer::TableWriter;
