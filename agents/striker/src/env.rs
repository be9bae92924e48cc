//! The joints' limits, as vectors, from `env`: the description of table and robot that the evaluator sends in the message `hello`.

pub use faceoff_agent::{BaseFrame, Env, JOINTS, RadiusInfo, RobotInfo, TableInfo};
use nalgebra::SVector;

/// A value per joint.
pub type Joints = SVector<f64, JOINTS>;

/// Share of the joint limits beyond which the evaluator counts a violation.
pub const LIMIT_SHARE: f64 = 0.95;

/// Largest allowed joint speeds, radians per second.
#[must_use]
pub fn joint_speed_max(robot: &RobotInfo) -> Joints {
    allowed_max(&robot.joint_vel_limit)
}

/// Largest allowed joint angles (the ranges are symmetric), radians.
#[must_use]
pub fn joint_angle_max(robot: &RobotInfo) -> Joints {
    allowed_max(&robot.joint_pos_limit)
}

/// The allowed share of the symmetric limits [lower, upper].
fn allowed_max([lower, upper]: &[[f64; JOINTS]; 2]) -> Joints {
    Joints::from_fn(|i, _| LIMIT_SHARE * upper[i].min(-lower[i]))
}
