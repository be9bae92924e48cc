//! Read-only queries for the API and the pages.

pub(crate) mod ablations;
pub(crate) mod board;
pub(crate) mod board_days;
mod days;
mod episode_summaries;
pub(crate) mod evaluations;
mod events;
pub(crate) mod gauges;
mod leases;
pub(crate) mod proposals;
pub(crate) mod queue_forecast;
pub(crate) mod runs;
mod season;
mod stages;
pub(crate) mod storage;
pub(crate) mod subject_contexts;
mod submissions;
mod teams;
pub(crate) mod tournaments;
pub(crate) mod worker_bans;
