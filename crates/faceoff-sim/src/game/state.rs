use crate::{episode::constraints::ConstraintValues, model::JOINTS, world::World};

/// True state of a game, recorded per step. SI units, radians; the puck in the table frame. Pairs are robot
/// 1's first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameState {
    /// x, y, yaw, vx, vy, yaw rate.
    pub puck: [f64; 6],
    pub q: [[f64; JOINTS]; 2],
    pub dq: [[f64; JOINTS]; 2],
    pub universal: [[f64; 2]; 2],
    /// End effectors, each in its robot's own base frame.
    pub ee: [[f64; 3]; 2],
}

impl GameState {
    /// The current state and constraint values of a world of two robots: both need the same kinematics.
    pub(super) fn with_constraints(world: &World) -> (Self, [ConstraintValues; 2]) {
        let kinematics = [0, 1].map(|robot| world.kinematics(robot));
        let constraints = [0, 1].map(|robot| {
            ConstraintValues::new(
                &world.joints(robot),
                world.filtered_velocities(robot),
                &kinematics[robot],
            )
        });
        let state = Self {
            puck: world.puck().state(),
            q: [0, 1].map(|robot| world.joints(robot)),
            dq: [0, 1].map(|robot| world.joint_velocities(robot)),
            universal: [0, 1].map(|robot| world.universal(robot)),
            ee: kinematics.map(|robot| robot.end_effector.origin.lane(0)),
        };
        (state, constraints)
    }
}
