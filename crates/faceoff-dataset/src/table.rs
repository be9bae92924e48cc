//! The Parquet tables of evaluations (control steps, episodes) and of games: their columns, and writing of their rows.

mod column_orders;
mod columns;
mod episodes;
mod game;
mod join;
mod steps;
mod writer;

pub(crate) use episodes::EpisodeRows;
pub(crate) use game::{EntryRows, MotionRows, RallyRows, SIDE_TIMES, SideRows};
pub(crate) use join::{ShardTable, join};
pub(crate) use steps::{
    HOST_INTERFERENCE, StepRows, constraint_columns, step_schema, with_zero_host_interference,
};
pub(crate) use writer::TableWriter;
