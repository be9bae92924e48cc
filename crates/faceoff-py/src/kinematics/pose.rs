//! Forward kinematics and Jacobian of the simulator, at one *pose*: the angles of the seven joints.

use faceoff_sim::{
    JOINTS,
    dynamics::{arm::Kinematics, spatial::Vec3},
    robot::inverse_kinematics::with_zero_universal,
};
use std::array::from_fn;

/// The kinematics at a pose, rad, with the universal joint (between arm and mallet) at zero. Inlining lets the compiler drop unused
/// results, a third of the time of `arm_forward`.
#[inline(always)]
pub fn kinematics_at(q: &[f64; JOINTS]) -> Kinematics<f64> {
    Kinematics::new(&with_zero_universal(q))
}

/// Derivative of the end effector's position by each joint, m/rad.
pub fn jacobian(kinematics: &Kinematics<f64>) -> [Vec3<f64>; JOINTS] {
    from_fn(|joint| kinematics.axes[joint].velocity_at(kinematics.end_effector.origin))
}

/// Heights of the origins of links 4 and 7, m.
pub fn elbow_and_wrist_m(kinematics: &Kinematics<f64>) -> [f64; 2] {
    [3, 6].map(|link: usize| kinematics.links[link].origin.z)
}
