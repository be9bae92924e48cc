//! Forward kinematics of the arm: the position of the mallet, and its Jacobian, from the joint angles, in the arm's own base frame.
//!
//! The arm is a serial chain of seven revolute joints, each turning about the local z axis of its
//! body, with the mallet's joint ("end effector") at the tip of a rod on the last link. The mallet
//! itself hangs on a passive universal joint that keeps it upright, so only the position of the
//! end effector matters and four of the seven degrees of freedom are free.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::env::{JOINTS, Joints};

/// Rows: x, y, z of the end effector; columns: joints.
pub type Jacobian = SMatrix<f64, 3, JOINTS>;

/// Origin of each joint's body in the frame of the previous body, metres.
const ORIGINS_M: [[f64; 3]; JOINTS] = [
    [0.0, 0.0, 0.1575],
    [0.0, 0.0, 0.2025],
    [0.0, 0.2045, 0.0],
    [0.0, 0.0, 0.2155],
    [0.0, 0.1845, 0.0],
    [0.0, 0.0, 0.2155],
    [0.0, 0.081, 0.0],
];
/// Distance of the end effector from link 7's origin along its z axis, metres.
const ROD_M: f64 = 0.585;

// The same lengths, in metres, for an arm in one vertical plane (joints 3 and 5 at zero).
/// Height of joint 2's axis.
pub const SHOULDER_M: f64 = 0.1575 + 0.2025;
/// From joint 2's to joint 4's axis.
pub const UPPER_ARM_M: f64 = 0.2045 + 0.2155;
/// From joint 4's to joint 6's axis.
pub const FOREARM_M: f64 = 0.1845 + 0.2155;
/// From joint 6's axis to the end effector.
pub const HAND_M: f64 = 0.081 + ROD_M;

/// Orientation of a joint's body in the frame of the previous body at joint angle zero. All of them are multiples of quarter
/// turns, so exact matrices stand in for the quaternions.
#[rustfmt::skip]
fn mounting(joint: usize) -> Matrix3<f64> {
    match joint {
        // identity
        0 => Matrix3::identity(),
        // (0, 0, √½, √½): half a turn about the bisector of y and z
        1 | 2 | 4 | 6 => Matrix3::new(
            -1.0, 0.0, 0.0,
             0.0, 0.0, 1.0,
             0.0, 1.0, 0.0),
        // (√½, √½, 0, 0): a quarter turn about x
        _ => Matrix3::new(
            1.0, 0.0,  0.0,
            0.0, 0.0, -1.0,
            0.0, 1.0,  0.0),
    }
}

/// Positions and Jacobian for one joint configuration.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// End effector, metres.
    pub tip: Vector3<f64>,
    /// Height of link 4's origin (elbow), metres.
    pub elbow_z: f64,
    /// Height of link 7's origin (wrist), metres.
    pub wrist_z: f64,
    /// Derivative of the tip by the joint angles.
    pub jacobian: Jacobian,
}

/// Computes the arm's pose at the joint angles `q`, radians.
#[must_use]
pub fn forward(q: &Joints) -> Pose {
    let mut rotation = Matrix3::identity();
    let mut position = Vector3::zeros();
    let mut origins = [Vector3::zeros(); JOINTS];
    let mut axes = [Vector3::zeros(); JOINTS];
    for i in 0..JOINTS {
        position += rotation * Vector3::from(ORIGINS_M[i]);
        let (sin, cos) = q[i].sin_cos();
        rotation =
            rotation * mounting(i) * Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        origins[i] = position;
        axes[i] = rotation.column(2).into();
    }
    let tip = position + rotation * Vector3::new(0.0, 0.0, ROD_M);
    let mut jacobian = Jacobian::zeros();
    for i in 0..JOINTS {
        jacobian.set_column(i, &axes[i].cross(&(tip - origins[i])));
    }
    Pose {
        tip,
        elbow_z: origins[3].z,
        wrist_z: origins[6].z,
        jacobian,
    }
}

#[cfg(test)]
mod tests;
