//! The controller of the *universal joint*, the two hinges between end effector and mallet: it keeps the mallet vertical. Its constants
//! are those of the *reference*, the simulator of the 2023 Robot Air Hockey Challenge. Vectors are in the robot's base frame.

use crate::dynamics::{
    angles,
    lanes::{Lanes, gather, row},
    spatial::Vec3,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Proportional gain, N m/rad.
pub(crate) const KP: f64 = 4.0;
/// Derivative gain, N m s/rad.
pub(crate) const KD: f64 = 0.31;
/// Torque limit ± of a hinge, N m.
pub(crate) const TORQUE_LIMIT_N_M: f64 = 10.0;
/// Limit ± of the desired angles, rad.
pub(crate) const RANGE_RAD: f64 = 0.95 * FRAC_PI_2;
/// Weights of the new and of the previous value in the low-pass filter of the hinge velocity, per substep of 1 ms.
pub(crate) const FILTER_NEW: f64 = 0.273;
const FILTER_OLD: f64 = 0.727;

/// State of the controller: the filtered hinge velocities, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniversalJointController<T = f64> {
    velocity_filtered: [T; 2],
}

impl<T: Lanes> UniversalJointController<T> {
    pub fn at_rest() -> Self {
        Self {
            velocity_filtered: [T::splat(0.0); 2],
        }
    }

    /// Collects the controllers of several arms.
    #[inline(always)]
    pub fn gather<'a>(controller: impl Fn(usize) -> &'a UniversalJointController) -> Self {
        Self {
            velocity_filtered: gather(|lane| &controller(lane).velocity_filtered),
        }
    }

    /// The controller of one arm.
    pub fn lane(&self, lane: usize) -> UniversalJointController {
        UniversalJointController {
            velocity_filtered: row(&self.velocity_filtered, lane),
        }
    }

    /// Torques of the hinges in one substep, N m. `x` and `y` are the first two columns of the end effector's
    /// rotation matrix, `angle` (rad) and `velocity` (rad/s) those of the hinges.
    #[inline(always)]
    pub fn torque(&mut self, x: Vec3<T>, y: Vec3<T>, angle: [T; 2], velocity: [T; 2]) -> [T; 2] {
        let target = mallet_vertical_angles(x, y, angle);
        let limit = T::splat(TORQUE_LIMIT_N_M);
        std::array::from_fn(|i| {
            let filtered = &mut self.velocity_filtered[i];
            *filtered = T::splat(FILTER_NEW) * velocity[i] + T::splat(FILTER_OLD) * *filtered;
            let torque = T::splat(KP) * (target[i] - angle[i]) - T::splat(KD) * *filtered;
            torque.at_least(-limit).at_most(limit)
        })
    }
}

/// The hinge angles, rad, at which the mallet is vertical. Of the angles that differ by whole turns, those nearest to `previous`. `x` and
/// `y` are the first two columns of the end effector's rotation matrix.
#[inline(always)]
pub fn mallet_vertical_angles<T: Lanes>(x: Vec3<T>, y: Vec3<T>, previous: [T; 2]) -> [T; 2] {
    let zero = T::splat(0.0);
    let range = T::splat(RANGE_RAD);
    let within_range = |angle: T| angle.at_least(-range).at_most(range);
    let level_x = Vec3::new(-y.y, y.x, zero);
    let first = signed_angle(x, level_x, y);
    let x = reference_rotation(y, first, x);
    let level_y = Vec3::new(x.y, -x.x, zero);
    let second = signed_angle(y, level_y, x);
    [
        within_range(nearest_turn(first, previous[0])),
        within_range(nearest_turn(second, previous[1])),
    ]
}

/// Adds a whole turn to `angle`, or subtracts one, if that brings it nearer to `previous`.
#[inline(always)]
fn nearest_turn<T: Lanes>(angle: T, previous: T) -> T {
    let (pi, turn) = (T::splat(PI), T::splat(TAU));
    let difference = angle - previous;
    let behind = T::select(difference.less_than(-pi), angle + turn, angle);
    T::select(pi.less_than(difference), angle - turn, behind)
}

/// Angle from `a` to `b` about `axis`, rad.
#[inline(always)]
fn signed_angle<T: Lanes>(a: Vec3<T>, b: Vec3<T>, axis: Vec3<T>) -> T {
    angles::atan2(a.cross(b).dot(axis), a.dot(b))
}

/// The reference's rotation of `v` about `axis`: Rodrigues' formula, but with the cross-product
/// matrix squared entry by entry instead of multiplied with itself. This error is kept, because agents are tuned to
/// the mallet's resulting tilt.
#[inline(always)]
fn reference_rotation<T: Lanes>(axis: Vec3<T>, angle: T, v: Vec3<T>) -> Vec3<T> {
    let (sin, cos) = angles::sin_cos(angle);
    let (axis_cross_v, one_minus_cos) = (axis.cross(v), T::splat(1.0) - cos);
    let [xx, yy, zz] = [axis.x * axis.x, axis.y * axis.y, axis.z * axis.z];
    let squared = Vec3::new(
        zz * v.y + yy * v.z,
        zz * v.x + xx * v.z,
        yy * v.x + xx * v.y,
    );
    v + axis_cross_v.scale(sin) + squared.scale(one_minus_cos)
}
