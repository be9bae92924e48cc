//! Distributes a motion of the tip over seven joints, with four free degrees of freedom.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::env::{JOINTS, Joints};
use crate::kinematics::Jacobian;

/// The joint change of minimum weighted norm that moves the tip by `delta`.
pub fn least_change(jacobian: &Jacobian, delta: &Vector3<f64>, cap: &Joints) -> Joints {
    weighted_least_squares(jacobian, delta, &cap.component_mul(cap))
}

/// Joint speeds for the tip velocity with moderate load on all joints: a few steps of reweighted
/// least squares towards the 4-norm of the loads.
pub fn even_speeds(jacobian: &Jacobian, velocity: &Vector3<f64>, cap: &Joints) -> Joints {
    let square = cap.component_mul(cap);
    let mut speeds = weighted_least_squares(jacobian, velocity, &square);
    for _ in 0..4 {
        let load = speeds.component_div(cap);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        // The fourth power's weight is load²; the floor keeps idle joints available.
        let compliance = Joints::from_fn(|i, _| square[i] / (load[i] / peak).powi(2).max(0.05));
        speeds = 0.5 * (speeds + weighted_least_squares(jacobian, velocity, &compliance));
    }
    speeds
}

/// Joint speeds for the tip velocity with a nearly minimum peak load: Lawson's iteration repeatedly
/// divides the compliances by the resulting loads.
pub fn least_peak(
    jacobian: &Jacobian,
    velocity: &Vector3<f64>,
    cap: &Joints,
    compliance: &mut Joints,
    rounds: usize,
) -> Joints {
    let mut speeds = weighted_least_squares(jacobian, velocity, compliance);
    for _ in 0..rounds {
        let load = speeds.component_div(cap);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        for i in 0..JOINTS {
            // The floor keeps an idle joint available.
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
    let cjt = SMatrix::<f64, JOINTS, 3>::from_fn(|i, k| compliance[i] * jacobian[(k, i)]);
    let square: Matrix3<f64> = jacobian * cjt;
    // Singular only for a stretched arm, outside of the workspace; the damping keeps the result finite
    // there.
    let damped = square + Matrix3::identity() * 1e-9;
    damped
        .try_inverse()
        .map_or_else(Joints::zeros, |inverse| cjt * (inverse * delta))
}
