//! The baseline in the simulator under all perturbations, with fixed seeds: its strength is in the intended range.

#[path = "../../../striker/tests/support/mod.rs"]
mod support;

mod games;
mod tasks;
