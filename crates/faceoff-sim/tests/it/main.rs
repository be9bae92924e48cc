//! The simulator against the reference's recordings, its own promises, and itself.

mod arm_tracking;
mod episodes;
mod kinematics;
mod mallet_impact;
mod puck;
mod reference;
