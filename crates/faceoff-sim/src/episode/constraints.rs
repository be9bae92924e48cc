//! The constraints on a robot's motion, whose violation costs penalty points (`docs/rules.md`, "Penalty points"). There are
//! four: on the joint positions, the joint velocities, the end effector (the tip of the arm, which carries the mallet) and the links.

use crate::{
    dynamics::arm::Kinematics,
    model::{EE_DESIRED_HEIGHT_M, JOINTS, LIMIT_FRACTION, LINKS, TOOL},
    table::geometry::TABLE,
    world::World,
};
use faceoff_types::{ViolationName, Violations};

/// Name of the violation of the end effector's bounds: it must be over the table and at its height.
pub const EE: ViolationName = ViolationName::new("ee");
/// Name of the violation by elbow (link 4) or wrist (link 7): they must not be too low.
pub const LINK: ViolationName = ViolationName::new("link");
/// Name of the violation of joint positions: they must be within 95 % of their limits.
pub const JOINT_POS: ViolationName = ViolationName::new("joint_pos");
/// Name of the violation of joint velocities: filtered, they must be within 95 % of their limits.
pub const JOINT_VEL: ViolationName = ViolationName::new("joint_vel");

/// Tolerance ± of the end effector's height, m.
pub const HEIGHT_TOLERANCE_M: f64 = 0.02;

/// Least height of elbow and wrist in the robot's base frame, m.
pub const LINK_HEIGHT_M: f64 = 0.25;

/// For each constraint, the largest excess over one of its bounds. A constraint is violated if its value is above 0. Joint positions are in
/// rad, joint velocities in rad/s, the others in m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ConstraintValues {
    /// Joint positions against 95 % of their range.
    pub joint_pos: f64,
    /// Filtered joint velocities against 95 % of their limits.
    pub joint_vel: f64,
    /// End effector against its area of the table and its height.
    pub ee: f64,
    /// Elbow (link 4) and wrist (link 7) against their least height.
    pub link: f64,
}

impl ConstraintValues {
    pub(crate) const ZERO: Self = Self {
        joint_pos: 0.0,
        joint_vel: 0.0,
        ee: 0.0,
        link: 0.0,
    };

    /// Constraint values of a robot (0 or 1) in its current state.
    #[must_use]
    pub fn of(world: &World, robot: usize) -> Self {
        Self::new(
            &world.joints(robot),
            world.filtered_velocities(robot),
            &world.kinematics(robot),
        )
    }

    /// Constraint values at joint positions `q` (rad), filtered joint velocities (rad/s), and the kinematics of these positions.
    #[must_use]
    pub fn new(
        q: &[f64; JOINTS],
        dq_filtered: &[f64; JOINTS],
        kinematics: &Kinematics<f64>,
    ) -> Self {
        let mut values = Self {
            joint_pos: f64::NEG_INFINITY,
            joint_vel: f64::NEG_INFINITY,
            ..Self::default()
        };
        for (i, link) in LINKS.iter().enumerate() {
            let position = q[i].abs() - LIMIT_FRACTION * link.range_rad;
            let velocity = dq_filtered[i].abs() - LIMIT_FRACTION * link.velocity_limit_rad_s;
            values.joint_pos = values.joint_pos.max(position);
            values.joint_vel = values.joint_vel.max(velocity);
        }
        let [x, y, z] = kinematics.end_effector.origin.to_array();
        let radius = TOOL.cylinder_radius_m;
        // Least x of the end effector, so that the mallet stays on the table.
        let near_edge_x = TABLE.base_x_m - (TABLE.half_length_m() - radius);
        values.ee = (near_edge_x - x)
            .max(y.abs() - (TABLE.half_width_m() - radius))
            .max((z - EE_DESIRED_HEIGHT_M).abs() - HEIGHT_TOLERANCE_M);
        let lowest = kinematics.links[3]
            .origin
            .z
            .min(kinematics.links[6].origin.z);
        values.link = LINK_HEIGHT_M - lowest;
        values
    }

    /// Sets the flags of the violated constraints in `violations`; other flags are kept.
    pub fn mark(&self, violations: &mut ViolatedConstraints) {
        violations.ee |= self.ee > 0.0;
        violations.link |= self.link > 0.0;
        violations.joint_pos |= self.joint_pos > 0.0;
        violations.joint_vel |= self.joint_vel > 0.0;
    }
}

/// Which constraints the robot's motion violated at least once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ViolatedConstraints {
    /// End-effector position.
    pub ee: bool,
    /// Elbow and wrist height.
    pub link: bool,
    /// Joint positions.
    pub joint_pos: bool,
    /// Joint velocities.
    pub joint_vel: bool,
}

/// Under the names of the competition, in its display order.
impl From<ViolatedConstraints> for Violations {
    fn from(violated: ViolatedConstraints) -> Self {
        let ViolatedConstraints {
            ee,
            link,
            joint_pos,
            joint_vel,
        } = violated;
        let named = [
            (EE, ee),
            (LINK, link),
            (JOINT_POS, joint_pos),
            (JOINT_VEL, joint_vel),
        ];
        named.into_iter().collect()
    }
}
