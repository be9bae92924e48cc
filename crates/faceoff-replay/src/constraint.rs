//! The constraints on a robot's motion, each of which has one kind of violation.

use faceoff_airhockey::{EE, JOINT_POS, JOINT_VEL, LINK};
use faceoff_sim::ConstraintValues;
use faceoff_types::ViolationName;
use serde::{Deserialize, Serialize};

/// A constraint on the motion of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub enum Constraint {
    /// Position of the end effector, m.
    Ee,
    /// Height of elbow and wrist, m.
    Link,
    /// Joint positions, rad.
    JointPos,
    /// Joint velocities, rad/s.
    JointVel,
}

impl Constraint {
    pub const ALL: [Self; 4] = [Self::Ee, Self::Link, Self::JointPos, Self::JointVel];

    /// The name of its kind of violation.
    #[must_use]
    pub const fn name(self) -> ViolationName {
        match self {
            Self::Ee => EE,
            Self::Link => LINK,
            Self::JointPos => JOINT_POS,
            Self::JointVel => JOINT_VEL,
        }
    }

    /// The value of the constraint; above 0 it is violated.
    #[must_use]
    pub const fn value(self, values: &ConstraintValues) -> f64 {
        match self {
            Self::Ee => values.ee,
            Self::Link => values.link,
            Self::JointPos => values.joint_pos,
            Self::JointVel => values.joint_vel,
        }
    }
}
