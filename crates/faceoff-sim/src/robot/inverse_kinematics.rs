//! Damped least-squares inverse kinematics: joint positions for a position of the end effector, the tip of the arm's rod. The method and
//! its constants are those of the *reference*, the simulator of the 2023 Robot Air Hockey Challenge.

use crate::{
    dynamics::{arm::Kinematics, spatial::Vec3},
    model::{DOFS, JOINTS, LIMIT_FRACTION, LINKS},
};
use nalgebra::{Matrix3, Vector3};

/// Added to the diagonal of the normal equations (λ below), m².
const DAMPING: f64 = 1e-3;
/// Longest step of an iteration in joint space, rad.
const STEP_LIMIT_RAD: f64 = 0.1;
/// Distance from the target at which the iteration ends, m.
const TOLERANCE_M: f64 = 1e-4;
/// Largest number of iterations.
const ITERATIONS: usize = 1000;

/// Joint positions that bring the end effector within 0.1 mm of `target` (m, robot's base frame),
/// found from `start`. Orientation is free. Returns the last iterate when the target cannot be
/// reached.
#[must_use]
pub fn inverse_kinematics(target: [f64; 3], start: &[f64; JOINTS]) -> [f64; JOINTS] {
    let mut q = *start;
    for _ in 0..ITERATIONS {
        let kinematics = Kinematics::new(&with_zero_universal(&q));
        let ee = kinematics.end_effector.origin;
        let error = Vector3::new(target[0] - ee.x, target[1] - ee.y, target[2] - ee.z);
        if error.norm() < TOLERANCE_M {
            break;
        }
        // The columns of the Jacobian J: velocity of the end effector per rate of each joint, m/rad.
        let columns: [Vec3<f64>; JOINTS] =
            std::array::from_fn(|i| kinematics.axes[i].velocity_at(ee));
        // The step is (Jᵀ J + λ I)⁻¹ Jᵀ e = Jᵀ (J Jᵀ + λ I)⁻¹ e with the error e; the inverse on the right is only 3×3.
        let mut normal = Matrix3::identity() * DAMPING;
        for c in columns {
            let c = Vector3::new(c.x, c.y, c.z);
            normal += c * c.transpose();
        }
        let Some(inverse) = normal.try_inverse() else {
            break;
        };
        let w = inverse * error;
        let mut delta: [f64; JOINTS] = columns.map(|c| c.x * w.x + c.y * w.y + c.z * w.z);
        let norm = delta.iter().map(|d| d * d).sum::<f64>().sqrt();
        if norm > STEP_LIMIT_RAD {
            delta = delta.map(|d| d * STEP_LIMIT_RAD / norm);
        }
        for i in 0..JOINTS {
            let limit = LIMIT_FRACTION * LINKS[i].range_rad;
            q[i] = (q[i] + delta[i]).clamp(-limit, limit);
        }
    }
    q
}

/// Appends the angles of the universal joint (the two hinges of the mallet), both zero, to the driven joints' positions, rad.
pub fn with_zero_universal(q: &[f64; JOINTS]) -> [f64; DOFS] {
    let mut all = [0.0; DOFS];
    all[..JOINTS].copy_from_slice(q);
    all
}
