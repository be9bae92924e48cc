//! The store on real SQLite files and real artifact folders.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod ablations;
mod acts;
mod artifacts;
mod bundles;
mod competition;
mod days;
mod deadlines;
mod events;
mod faults;
mod fixture;
mod full_disk;
mod growth;
mod interleavings;
mod kill;
mod migration;
mod offline_data;
mod opening;
mod outlook;
mod people;
mod proposals;
mod queries;
mod queue;
mod registrations;
mod releases;
mod retries;
mod rulesets;
mod rulings;
mod shares;
mod sign_off;
mod stages;
mod teams;
mod tokens;
