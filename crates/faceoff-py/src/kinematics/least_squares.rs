//! Inverse kinematics from a start pose: damped least squares, each joint weighted by its velocity limit.

use super::{
    constants::{Arm, CONVERGENCE_TOLERANCE_M, DAMPING, ITERATIONS, LOWEST_M, STEP_LIMIT_RAD},
    pose::{jacobian, kinematics_at},
};
use faceoff_sim::{JOINTS, dynamics::spatial::Vec3};
use std::array::from_fn;

/// Joint positions, rad, near `start` that put the end effector at a point, m; the last iterate if there is no solution.
pub fn solve_near(arm: &Arm, point: Vec3<f64>, start: &[f64; JOINTS]) -> [f64; JOINTS] {
    let clamped = |joint: usize, angle: f64| {
        let bound = arm.bound_rad[joint];
        angle.clamp(-bound, bound)
    };
    let mut q = from_fn(|joint| clamped(joint, start[joint]));
    for _ in 0..ITERATIONS {
        let kinematics = kinematics_at(&q);
        let wrist = kinematics.links[JOINTS - 1].origin;
        let error = point - kinematics.end_effector.origin;
        let deficit = LOWEST_M - wrist.z;
        if error.dot(error).sqrt() < CONVERGENCE_TOLERANCE_M && deficit <= 0.0 {
            break;
        }
        let linearisation = Linearisation {
            columns: jacobian(&kinematics),
            rise: from_fn(|joint| kinematics.axes[joint].velocity_at(wrist).z),
            error,
            deficit,
        };
        let mut step = linearisation.step(&arm.weight);
        let is_at_bound: [bool; JOINTS] = from_fn(|joint| {
            let (angle, bound) = (q[joint], arm.bound_rad[joint]);
            (angle + step[joint]).abs() > bound && angle.abs() >= bound && angle * step[joint] > 0.0
        });
        if is_at_bound.contains(&true) {
            let unblocked_weight = from_fn(|joint| {
                if is_at_bound[joint] {
                    0.0
                } else {
                    arm.weight[joint]
                }
            });
            step = linearisation.step(&unblocked_weight);
        }
        let length = inner_product(&step, &step).sqrt();
        let step_fraction = (STEP_LIMIT_RAD / length.max(1e-300)).min(1.0);
        q = from_fn(|joint| clamped(joint, q[joint] + step_fraction * step[joint]));
    }
    q
}

/// The problem of one step, linearised at a pose.
struct Linearisation {
    /// Derivative of the end effector's position by each joint, m/rad.
    columns: [Vec3<f64>; JOINTS],
    /// Derivative of the wrist's height by each joint, m/rad.
    rise: [f64; JOINTS],
    /// From the end effector to its target, m.
    error: Vec3<f64>,
    /// How far the wrist is below its minimum height, m.
    deficit: f64,
}

impl Linearisation {
    /// Step towards the target, rad. A low wrist is raised without moving the end effector.
    fn step(&self, weight: &[f64; JOINTS]) -> [f64; JOINTS] {
        let step = least_change(&self.columns, self.error, weight);
        if self.deficit <= 0.0 {
            return step;
        }
        let raising_change: [f64; JOINTS] = from_fn(|joint| weight[joint] * self.rise[joint]);
        let end_effector_shift = self
            .columns
            .iter()
            .zip(raising_change)
            .fold(Vec3::zero(), |sum, (column, change)| {
                sum + column.scale(change)
            });
        let compensation = least_change(&self.columns, end_effector_shift, weight);
        let null_space_change: [f64; JOINTS] =
            from_fn(|joint| raising_change[joint] - compensation[joint]);
        let null_space_fraction =
            self.deficit / inner_product(&self.rise, &null_space_change).max(1e-3);
        from_fn(|joint| step[joint] + null_space_fraction * null_space_change[joint])
    }
}

/// The smallest weighted joint change that moves the end effector by `desired`, d: W Jᵀ (J W Jᵀ + λ I)⁻¹ d, where the
/// columns are those of J.
pub fn least_change(
    columns: &[Vec3<f64>; JOINTS],
    desired: Vec3<f64>,
    weight: &[f64; JOINTS],
) -> [f64; JOINTS] {
    let mut a = Vec3::new(DAMPING, 0.0, 0.0);
    let mut b = Vec3::new(0.0, DAMPING, 0.0);
    let mut c = Vec3::new(0.0, 0.0, DAMPING);
    for (column, &weight) in columns.iter().zip(weight) {
        a = a + column.scale(weight * column.x);
        b = b + column.scale(weight * column.y);
        c = c + column.scale(weight * column.z);
    }
    // The inverse of a symmetric matrix by its rows' vector products.
    let (bc, ca, ab) = (b.cross(c), c.cross(a), a.cross(b));
    // (J W Jᵀ + λ I)⁻¹ d
    let multiplier =
        (bc.scale(desired.x) + ca.scale(desired.y) + ab.scale(desired.z)).scale(1.0 / a.dot(bc));
    from_fn(|joint| weight[joint] * columns[joint].dot(multiplier))
}

fn inner_product(a: &[f64; JOINTS], b: &[f64; JOINTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
