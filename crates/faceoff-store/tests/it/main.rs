//! The store on real SQLite files and real artifact folders.

mod artifacts;
mod competition;
mod faults;
mod fixture;
mod interleavings;
mod kill;
mod offline_data;
mod opening;
mod queue;
mod teams;
mod turns;
