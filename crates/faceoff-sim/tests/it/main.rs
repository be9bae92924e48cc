//! The simulator against the reference's recordings, its own promises, and itself.

#![expect(
    clippy::print_stdout,
    reason = "`--nocapture` shows how far from each recording the simulator is"
)]
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read its recording fails"
)]

mod allocation;
mod arithmetic;
mod arm_tracking;
mod batch;
mod delay;
mod determinism;
mod episodes;
mod game;
mod golden;
mod hostile;
mod kinematics;
mod mallet_impact;
mod outcomes;
mod perturbations;
mod puck;
mod reference;
mod replay;
mod robot_document;
mod together;
