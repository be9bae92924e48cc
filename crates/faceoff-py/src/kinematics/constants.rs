//! The arm's lengths and bounds, from the simulator's model, and the parameters of the inverses.
//!
//! The parameters have the names and values of `kinematics/plain.py` in the Python package, which computes the same without NumPy and
//! this crate; a test compares them.

use super::pose::kinematics_at;
use faceoff_sim::{
    JOINTS,
    episode::constraints::LINK_HEIGHT_M,
    model::{INITIAL_Q, LIMIT_FRACTION, LINKS, Offset, TOOL},
    table::geometry::TABLE,
};
use std::{array::from_fn, sync::LazyLock};

/// Margin of commanded joints to the rules' bounds, for the controller's errors.
pub const JOINT_MARGIN_RAD: f64 = 0.01;
/// Margin of elbow and wrist to their minimum height.
pub const HEIGHT_MARGIN_M: f64 = 0.01;
/// A *pose* (the angles of all joints) is a solution if its end effector is this close to the point.
pub const SOLUTION_TOLERANCE_M: f64 = 1e-6;
/// The least-squares iteration stops when the end effector is this close to the point.
pub const CONVERGENCE_TOLERANCE_M: f64 = 1e-10;
/// Most iterations of the least squares.
pub const ITERATIONS: usize = 100;
/// Longest step of an iteration, in joint space.
pub const STEP_LIMIT_RAD: f64 = 0.3;
/// Added to the diagonal of the normal equations of the least squares, so that they always have a solution.
pub const DAMPING: f64 = 1e-6;
/// Decrease of the hand's angle from straight up per metre of *reach*, the distance from joint 1's axis. The *hand* is the part from
/// joint 6 to the end effector.
pub const HAND_PER_REACH_RAD_M: f64 = 0.85;
/// The hand's angle from straight up in the start pose.
pub const START_HAND_RAD: f64 = INITIAL_Q[1] - INITIAL_Q[3] + INITIAL_Q[5];

/// The arm in one plane: height of joint 2, then from joint 2 to 4, from 4 to 6, from 6 to the end effector.
pub const SHOULDER_M: f64 = length_m(0) + length_m(1);
pub const UPPER_ARM_M: f64 = length_m(2) + length_m(3);
pub const FOREARM_M: f64 = length_m(4) + length_m(5);
pub const HAND_M: f64 = length_m(6) + TOOL.end_effector_z_m;

/// Minimum x and maximum |y| of the end effector, robot's base frame.
pub const X_MIN_M: f64 = TABLE.base_x_m - (TABLE.half_length_m() - TOOL.cylinder_radius_m);
pub const Y_MAX_M: f64 = TABLE.half_width_m() - TOOL.cylinder_radius_m;

/// Minimum height of elbow and wrist at a commanded pose.
pub const LOWEST_M: f64 = LINK_HEIGHT_M + HEIGHT_MARGIN_M;

/// The derived numbers, computed once.
pub static ARM: LazyLock<Arm> = LazyLock::new(Arm::new);

/// Numbers derived from the model.
#[derive(Debug)]
pub struct Arm {
    /// Bound of each commanded joint, ±.
    pub bound_rad: [f64; JOINTS],
    /// Weight of each joint in least squares: the square of its velocity limit, rad²/s².
    pub weight: [f64; JOINTS],
    /// Distance of the end effector from joint 1's axis in the start pose.
    pub start_reach_m: f64,
}

impl Arm {
    fn new() -> Self {
        // The elbow's height depends on joint 2 alone.
        let elbow_rad = libm::acos((LOWEST_M - SHOULDER_M) / UPPER_ARM_M);
        let start = kinematics_at(&INITIAL_Q).end_effector.origin;
        Self {
            bound_rad: from_fn(|joint| {
                let range = LIMIT_FRACTION * LINKS[joint].range_rad - JOINT_MARGIN_RAD;
                if joint == 1 {
                    range.min(elbow_rad)
                } else {
                    range
                }
            }),
            weight: LINKS.map(|link| link.velocity_limit_rad_s * link.velocity_limit_rad_s),
            start_reach_m: libm::hypot(start.x, start.y),
        }
    }
}

/// Distance between the joints of a link and its parent, m.
const fn length_m(link: usize) -> f64 {
    match LINKS[link].offset {
        Offset::Y(along) | Offset::Z(along) => along,
    }
}
