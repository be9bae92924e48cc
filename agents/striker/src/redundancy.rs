//! Distributes a motion of the tip, the arm's end, over the seven joints. The tip's position needs three, so four degrees of freedom are
//! free. The *load* of a joint is its speed relative to its largest, `speed_max`; its *compliance* is its weight in the distribution.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::env::{JOINTS, Joints};
use crate::kinematics::Jacobian;

/// The joint change of minimum weighted norm that moves the tip by `delta`.
pub fn least_change(jacobian: &Jacobian, delta: &Vector3<f64>, speed_max: &Joints) -> Joints {
    weighted_least_squares(jacobian, delta, &speed_max.component_mul(speed_max))
}

/// Joint speeds for the tip velocity with moderate load on all joints: a few iterations of reweighted
/// least squares, which approach the minimum of the sum of the loads' fourth powers.
pub fn even_speeds(jacobian: &Jacobian, velocity: &Vector3<f64>, speed_max: &Joints) -> Joints {
    let square = speed_max.component_mul(speed_max);
    let mut speeds = weighted_least_squares(jacobian, velocity, &square);
    for _ in 0..4 {
        let load = speeds.component_div(speed_max);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        // The weight for fourth powers is load²; the lower bound keeps joints without load available.
        let compliance = Joints::from_fn(|i, _| square[i] / (load[i] / peak).powi(2).max(0.05));
        speeds = 0.5 * (speeds + weighted_least_squares(jacobian, velocity, &compliance));
    }
    speeds
}

/// Joint speeds for the tip velocity with a nearly minimum peak load: Lawson's iteration repeatedly
/// divides the compliances by the resulting loads. `compliance` holds the first ones and, after it, the last ones.
pub fn least_peak(
    jacobian: &Jacobian,
    velocity: &Vector3<f64>,
    speed_max: &Joints,
    compliance: &mut Joints,
    iterations: usize,
) -> Joints {
    let mut speeds = weighted_least_squares(jacobian, velocity, compliance);
    for _ in 0..iterations {
        let load = speeds.component_div(speed_max);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        for i in 0..JOINTS {
            // The lower bound keeps a joint without load available.
            compliance[i] = (compliance[i] / (load[i].abs() / peak).max(0.1)).min(1e3);
        }
        *compliance /= compliance.min();
        speeds = weighted_least_squares(jacobian, velocity, compliance);
    }
    speeds
}

/// `C Jᵀ (J C Jᵀ)⁻¹ delta` with the diagonal compliance C.
pub fn weighted_least_squares(
    jacobian: &Jacobian,
    delta: &Vector3<f64>,
    compliance: &Joints,
) -> Joints {
    let compliance_jt = SMatrix::<f64, JOINTS, 3>::from_fn(|i, k| compliance[i] * jacobian[(k, i)]);
    let square: Matrix3<f64> = jacobian * compliance_jt;
    // Singular only for a stretched arm, outside of the workspace; the damping keeps the result finite
    // there.
    let damped = square + Matrix3::identity() * 1e-9;
    damped
        .try_inverse()
        .map_or_else(Joints::zeros, |inverse| compliance_jt * (inverse * delta))
}
