//! The baseline in the simulator under all perturbations, with fixed seeds: as strong as it is meant to be.

#[path = "../../../striker/tests/support/mod.rs"]
mod support;

mod games;
mod tasks;
