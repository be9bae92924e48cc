//! The true state of a game, as recordings contain it.

use crate::{episode::constraints::ConstraintValues, model::JOINTS, world::World};

/// The true state of a game after a control step. SI units, radians. In pairs, robot 1 comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameState {
    /// The puck's x, y, yaw, vx, vy, yaw rate, in the table frame.
    pub puck: [f64; 6],
    /// Positions of the driven joints.
    pub q: [[f64; JOINTS]; 2],
    /// Velocities of the driven joints.
    pub dq: [[f64; JOINTS]; 2],
    /// Angles of the universal joints, the two hinges of each mallet.
    pub universal: [[f64; 2]; 2],
    /// Positions of the end effectors, each in its robot's own base frame.
    pub ee: [[f64; 3]; 2],
}

impl GameState {
    /// The current state of a world with two robots, and their constraint values. They are computed together, since both need the
    /// robots' kinematics.
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
            ee: kinematics.map(|robot| robot.end_effector.origin.to_array()),
        };
        (state, constraints)
    }
}
