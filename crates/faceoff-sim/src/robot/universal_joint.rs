//! The controller of the universal joint, which keeps the mallet vertical (MODEL, "Universal joint").

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Proportional gain, N m/rad (ref).
const KP: f64 = 4.0;
/// Derivative gain, N m s/rad (ref).
const KD: f64 = 0.31;
/// Torque limit ±, N m (ref).
const TORQUE_LIMIT: f64 = 10.0;
/// Desired angles stay within this, rad (ref).
const RANGE: f64 = 0.95 * FRAC_PI_2;
/// Weight of the newest hinge velocity in the filter, and of the older ones (ref).
const FILTER_NEW: f64 = 0.273;
const FILTER_OLD: f64 = 0.727;

/// State of the controller: the filtered hinge velocities, rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UniversalJoint {
    velocity_filtered: [f64; 2],
}

impl UniversalJoint {
    /// Torques of one substep, N m. `x` and `y` are the first two columns of the end effector's
    /// rotation, `angle` and `velocity` those of the hinges.
    #[inline(always)]
    pub fn torque(
        &mut self,
        x: [f64; 3],
        y: [f64; 3],
        angle: [f64; 2],
        velocity: [f64; 2],
    ) -> [f64; 2] {
        let target = vertical(x, y, angle);
        std::array::from_fn(|i| {
            let filtered = &mut self.velocity_filtered[i];
            *filtered = FILTER_NEW * velocity[i] + FILTER_OLD * *filtered;
            let torque = KP * (target[i] - angle[i]) - KD * *filtered;
            torque.clamp(-TORQUE_LIMIT, TORQUE_LIMIT)
        })
    }
}

/// The hinge angles, rad, at which the mallet is vertical, the turn nearest to `previous`.
#[inline(always)]
pub fn vertical(x: [f64; 3], y: [f64; 3], previous: [f64; 2]) -> [f64; 2] {
    let level_x = [-y[1], y[0], 0.0];
    let first = signed_angle(x, level_x, y);
    let x = ref_rotate(y, first, x);
    let level_y = [x[1], -x[0], 0.0];
    let second = signed_angle(y, level_y, x);
    [
        unwrap(first, previous[0]).clamp(-RANGE, RANGE),
        unwrap(second, previous[1]).clamp(-RANGE, RANGE),
    ]
}

fn unwrap(angle: f64, previous: f64) -> f64 {
    if angle - previous > PI {
        angle - TAU
    } else if angle - previous < -PI {
        angle + TAU
    } else {
        angle
    }
}

/// Angle from `a` to `b` about `axis`, rad.
#[inline(always)]
fn signed_angle(a: [f64; 3], b: [f64; 3], axis: [f64; 3]) -> f64 {
    libm::atan2(dot(cross(a, b), axis), dot(a, b))
}

/// The reference's rotation of `v` about `axis`: Rodrigues' formula, but with the cross-product
/// matrix squared entry by entry instead of multiplied with itself. Kept, because agents were
/// tuned on the mallet's resulting tilt.
#[inline(always)]
fn ref_rotate(axis: [f64; 3], angle: f64, v: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = libm::sincos(angle);
    let (w, c) = (cross(axis, v), 1.0 - cos);
    let [xx, yy, zz] = [axis[0] * axis[0], axis[1] * axis[1], axis[2] * axis[2]];
    let squared = [
        zz * v[1] + yy * v[2],
        zz * v[0] + xx * v[2],
        yy * v[0] + xx * v[1],
    ];
    std::array::from_fn(|i| v[i] + sin * w[i] + c * squared[i])
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
