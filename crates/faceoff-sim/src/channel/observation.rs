//! An agent's observation: puck pose and velocity (x, y, yaw and their rates), seven joint positions, seven joint velocities and, with an
//! opponent, the position of its end effector; in the robot's base frame (`docs/protocol.md`, "Observations").

use crate::AirHockeyTask;
use crate::{
    table::{geometry::TABLE, puck::Puck},
    world::World,
};
use std::f64::consts::{PI, TAU};

/// Numbers in an observation without an opponent.
pub const OBSERVATION_LEN: usize = 20;
/// Numbers in an observation with an opponent.
pub const OBSERVATION_WITH_OPPONENT_LEN: usize = 23;

/// Numbers in the observation of a task. Only `hit` has an opponent.
#[must_use]
pub const fn len(task: AirHockeyTask) -> usize {
    match task {
        AirHockeyTask::Hit => OBSERVATION_WITH_OPPONENT_LEN,
        AirHockeyTask::Defend | AirHockeyTask::Prepare => OBSERVATION_LEN,
    }
}

/// The observation of a robot (0 or 1), in its own base frame, without noise: puck pose and
/// velocity, joint positions, filtered joint velocities, and the opponent's end effector. The last
/// three are zero without an opponent. SI units, radians.
#[must_use]
pub fn observe(world: &World, robot: usize) -> [f64; OBSERVATION_WITH_OPPONENT_LEN] {
    let mut observation = [0.0; OBSERVATION_WITH_OPPONENT_LEN];
    observation[..6].copy_from_slice(&puck_in_robot_frame(world.puck(), robot));
    observation[6..13].copy_from_slice(&world.joints(robot));
    observation[13..20].copy_from_slice(world.filtered_velocities(robot));
    if world.robots() == 2 {
        let [x, y, z] = world.end_effector_before(1 - robot);
        // Half a turn about the table's centre maps each base frame onto the other.
        observation[20..].copy_from_slice(&[2.0 * TABLE.base_x_m - x, -y, z]);
    }
    observation
}

/// The puck's pose (m, rad) and velocity (m/s, rad/s) in a robot's base frame.
fn puck_in_robot_frame(puck: &Puck, robot: usize) -> [f64; 6] {
    let ([x, y, yaw], [vx, vy, yaw_rate]) = (puck.pose, puck.velocity);
    if robot == 0 {
        [x + TABLE.base_x_m, y, wrap(yaw), vx, vy, yaw_rate]
    } else {
        [TABLE.base_x_m - x, -y, wrap(yaw - PI), -vx, -vy, yaw_rate]
    }
}

/// The same angle, rad, in [−π, π).
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let shifted = (angle + PI) - TAU * ((angle + PI) / TAU).floor();
    // Rounding may give the open end of the interval.
    if shifted >= TAU { -PI } else { shifted - PI }
}
