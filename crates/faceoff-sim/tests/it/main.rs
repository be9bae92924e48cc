//! The simulator against the reference's recordings, its own promises, and itself.

mod arm_tracking;
mod determinism;
mod episodes;
mod kinematics;
mod mallet_impact;
mod perturbations;
mod puck;
mod reference;
