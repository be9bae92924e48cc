//! The description of table and robot that an agent receives in the protocol's first message, `hello` (`docs/protocol.md`, "`env`").

use crate::AirHockeyTask;
use crate::{
    model::{CONTROL_STEP_S, EE_DESIRED_HEIGHT_M, JOINTS, LINKS, TOOL},
    table::{
        frames::axis_sign,
        geometry::{PUCK, TABLE},
    },
};

/// The content of `env` in `hello`, as plain data. SI units, radians. The robot is always the nominal one, without model mismatch.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvInfo {
    /// Number of robots on the table.
    pub n_agents: u32,
    /// Goal line to goal line.
    pub table_length: f64,
    /// Long side to long side.
    pub table_width: f64,
    /// Width of a goal.
    pub goal_width: f64,
    /// Radius of the puck.
    pub puck_radius: f64,
    /// Radius of the mallet.
    pub mallet_radius: f64,
    /// Height at which the rules want the end effector, in the robot's base frame.
    pub ee_desired_height: f64,
    /// The same height above the table's surface. The end effector is where the universal joint carries the mallet.
    pub universal_height: f64,
    /// Control steps per second.
    pub control_frequency: f64,
    /// Lower and upper joint position limits.
    pub joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper joint velocity limits.
    pub joint_vel_limit: [[f64; JOINTS]; 2],
    /// Lower and upper joint acceleration limits.
    pub joint_acc_limit: [[f64; JOINTS]; 2],
    /// 4×4 row-major transforms `table_from_robot`, the agent's own first.
    pub base_frame: Vec<[f64; 16]>,
    /// Length of a control step.
    pub dt: f64,
}

/// Acceleration limits are this many times the velocity limits, 1/s.
const ACCELERATION_PER_VELOCITY: f64 = 10.0;

/// The environment of a task, as seen by robot 1.
#[must_use]
pub fn env_info(task: AirHockeyTask) -> EnvInfo {
    env_info_for(if task == AirHockeyTask::Hit { 2 } else { 1 }, 0)
}

/// The environment of `robots` robots (1 or 2), as seen by the robot `own_robot` (0 or 1).
#[must_use]
pub fn env_info_for(robots: u32, own_robot: usize) -> EnvInfo {
    let lower_and_upper = |limit: fn(usize) -> f64| {
        [false, true].map(|upper| std::array::from_fn(|i| if upper { limit(i) } else { -limit(i) }))
    };
    let base_frame = |robot: usize| {
        let sign = axis_sign(robot);
        let (x, z) = (-sign * TABLE.base_x_m, TABLE.base_z_m);
        [
            sign, 0.0, 0.0, x, 0.0, sign, 0.0, 0.0, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0,
        ]
    };
    let robots_own_first = [own_robot, 1 - own_robot];
    EnvInfo {
        n_agents: robots,
        table_length: TABLE.length_m,
        table_width: TABLE.width_m,
        goal_width: TABLE.goal_width_m,
        puck_radius: PUCK.radius_m,
        mallet_radius: TOOL.cylinder_radius_m,
        ee_desired_height: EE_DESIRED_HEIGHT_M,
        universal_height: EE_DESIRED_HEIGHT_M + TABLE.base_z_m,
        control_frequency: 50.0,
        joint_pos_limit: lower_and_upper(|i| LINKS[i].range_rad),
        joint_vel_limit: lower_and_upper(|i| LINKS[i].velocity_limit_rad_s),
        joint_acc_limit: lower_and_upper(|i| {
            ACCELERATION_PER_VELOCITY * LINKS[i].velocity_limit_rad_s
        }),
        base_frame: robots_own_first
            .into_iter()
            .take(robots as usize)
            .map(base_frame)
            .collect(),
        dt: CONTROL_STEP_S,
    }
}
