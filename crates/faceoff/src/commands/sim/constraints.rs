//! The constraints in the output of `faceoff sim kinematics` and `faceoff sim trace`.

use faceoff_sim::ConstraintValues;
use serde::Serialize;

/// The largest value of each group of constraints: above 0 if it is violated.
#[derive(Debug, Serialize)]
pub(super) struct Constraints {
    joint_pos: f64,
    joint_vel: f64,
    ee: f64,
    link: f64,
}

impl From<ConstraintValues> for Constraints {
    fn from(values: ConstraintValues) -> Self {
        let ConstraintValues {
            joint_pos,
            joint_vel,
            ee,
            link,
        } = values;
        Self {
            joint_pos,
            joint_vel,
            ee,
            link,
        }
    }
}
