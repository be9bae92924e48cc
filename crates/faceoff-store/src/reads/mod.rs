//! What the API and the pages ask: no one waits for it, and it changes nothing.

pub(crate) mod ablations;
pub(crate) mod board;
pub(crate) mod concerns;
mod days;
pub(crate) mod evaluations;
mod events;
mod leases;
pub(crate) mod numbers;
pub(crate) mod outlook;
pub(crate) mod progress;
pub(crate) mod proposals;
pub(crate) mod runs;
mod season;
mod stages;
pub(crate) mod standings;
pub(crate) mod storage;
mod submissions;
mod summaries;
mod teams;
pub(crate) mod tournaments;
pub(crate) mod worker_bans;
