//! The store on real SQLite files and real artifact folders.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod ablations;
mod artifacts;
mod competition;
mod faults;
mod fixture;
mod interleavings;
mod kill;
mod offline_data;
mod opening;
mod queue;
mod releases;
mod teams;
mod turns;
