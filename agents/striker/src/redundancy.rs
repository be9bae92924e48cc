//! Sharing a motion of the tip between seven joints, four of which are free.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::env::{JOINTS, Joints};
use crate::kinematics::Jacobian;

/// The change of joints of least weighted norm that moves the tip by `delta`.
pub fn least_change(jacobian: &Jacobian, delta: &Vector3<f64>, cap: &Joints) -> Joints {
    weighted(jacobian, delta, &cap.component_mul(cap))
}

/// Joint speeds for the tip velocity with moderate load on all joints: a few steps of reweighted
/// least squares towards the 4-norm of the loads.
pub fn even_speeds(jacobian: &Jacobian, velocity: &Vector3<f64>, cap: &Joints) -> Joints {
    let square = cap.component_mul(cap);
    let mut speeds = weighted(jacobian, velocity, &square);
    for _ in 0..4 {
        let load = speeds.component_div(cap);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        // The fourth power's weight is load²; the floor keeps idle joints available.
        let compliance = Joints::from_fn(|i, _| square[i] / (load[i] / peak).powi(2).max(0.05));
        speeds = 0.5 * (speeds + weighted(jacobian, velocity, &compliance));
    }
    speeds
}

/// Joint speeds for the tip velocity whose largest load is nearly the least possible: Lawson's
/// iteration divides the compliances by the loads they led to, again and again.
pub fn least_peak(
    jacobian: &Jacobian,
    velocity: &Vector3<f64>,
    cap: &Joints,
    compliance: &mut Joints,
    rounds: usize,
) -> Joints {
    let mut speeds = weighted(jacobian, velocity, compliance);
    for _ in 0..rounds {
        let load = speeds.component_div(cap);
        let peak = load.amax();
        if peak < 1e-9 {
            break;
        }
        for i in 0..JOINTS {
            // Bounded relative to the others: an idle joint must be able to come back.
            compliance[i] = (compliance[i] / (load[i].abs() / peak).max(0.1)).min(1e3);
        }
        *compliance /= compliance.min();
        speeds = weighted(jacobian, velocity, compliance);
    }
    speeds
}

/// `C Jᵀ (J C Jᵀ)⁻¹ delta` with the diagonal compliance C.
pub fn weighted(jacobian: &Jacobian, delta: &Vector3<f64>, compliance: &Joints) -> Joints {
    let cjt = SMatrix::<f64, JOINTS, 3>::from_fn(|i, k| compliance[i] * jacobian[(k, i)]);
    let square: Matrix3<f64> = jacobian * cjt;
    // Singular only with the arm stretched out, which the workspace excludes; the damping keeps the
    // answer finite there.
    let damped = square + Matrix3::identity() * 1e-9;
    damped
        .try_inverse()
        .map_or_else(Joints::zeros, |inverse| cjt * (inverse * delta))
}
