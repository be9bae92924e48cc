//! Tests of the simulator: against recordings of the *reference* (the simulator of the 2023 Robot Air Hockey Challenge), and of its own
//! guarantees.

#![expect(
    clippy::print_stdout,
    reason = "`--nocapture` shows the difference to each recording"
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
mod episode_step;
mod episodes;
mod game;
mod golden;
mod held_arm;
mod hostile;
mod kinematics;
mod mallet_impact;
mod perturbations;
mod puck;
mod reference;
mod replay;
mod robot_document;
mod still_air;
mod success_rates;
