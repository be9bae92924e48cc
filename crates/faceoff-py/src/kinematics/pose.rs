//! Where a pose puts the arm, and how the end effector moves with it, as the simulator has it.

use faceoff_sim::{
    JOINTS,
    dynamics::{arm::Kinematics, spatial::Vec3},
    robot::inverse_kinematics::full,
};
use std::array::from_fn;

/// Where everything is at a pose, rad; the universal joint, which none of this depends on, at zero. Inlined, what a caller
/// does not use is not computed, which is a third of the time of `arm_forward`.
#[inline(always)]
pub fn at(q: &[f64; JOINTS]) -> Kinematics<f64> {
    Kinematics::new(&full(q))
}

/// How the end effector moves with each joint, m/rad.
pub fn jacobian(kinematics: &Kinematics<f64>) -> [Vec3<f64>; JOINTS] {
    from_fn(|joint| kinematics.axes[joint].at(kinematics.end_effector.origin))
}

/// Heights of the origins of links 4 and 7, m.
pub fn elbow_and_wrist_m(kinematics: &Kinematics<f64>) -> [f64; 2] {
    [3, 6].map(|link: usize| kinematics.links[link].origin.z)
}
