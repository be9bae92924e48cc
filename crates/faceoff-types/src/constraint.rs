//! Constraints on the robot's motion and on the agent's answer times, and which of them an episode violated.

use crate::ViolationName;
use serde::{Deserialize, Serialize};

/// A constraint whose violation costs penalty points (RULES, "Constraints and penalty points").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Constraint {
    /// End-effector position: over the table and at its height.
    Ee,
    /// Height of elbow (link 4) and wrist (link 7).
    Link,
    /// Joint positions within 95 % of their limits.
    JointPos,
    /// Filtered joint velocities within 95 % of their limits.
    JointVel,
    /// Time that the agent takes to answer a step.
    ComputationTime,
}

/// Which constraints the robot's motion violated at least once in an episode. Computation time is
/// judged from [`ComputationTime`](crate::ComputationTime), not here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Violations {
    /// End-effector position.
    pub ee: bool,
    /// Elbow and wrist height.
    pub link: bool,
    /// Joint positions.
    pub joint_pos: bool,
    /// Joint velocities.
    pub joint_vel: bool,
}

impl Violations {
    /// The names of the constraints and whether each was violated, in the order of tables.
    #[must_use]
    pub const fn by_name(&self) -> [(ViolationName, bool); 4] {
        [
            (ViolationName::new("ee"), self.ee),
            (ViolationName::new("link"), self.link),
            (ViolationName::new("joint_pos"), self.joint_pos),
            (ViolationName::new("joint_vel"), self.joint_vel),
        ]
    }
}
