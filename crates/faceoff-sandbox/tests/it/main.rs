//! The sandbox, attacked by real programs on the real host.

mod harness;
mod well_behaved;
