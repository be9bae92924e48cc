//! The description of table and robot that the evaluator sends as `env` in the message `hello`, made from the simulator's constants.

use faceoff_sim::env_info_for;
use striker::{BaseFrame, Env, RadiusInfo, RobotInfo, TableInfo};

/// The `env` for the agent of the robot with index 0 or 1, on a table with `robots` robots.
pub fn env(robots: u32, robot_index: usize) -> Env {
    let info = env_info_for(robots, robot_index);
    Env {
        dt: info.dt,
        table: TableInfo {
            length: info.table_length,
            width: info.table_width,
            goal_width: info.goal_width,
        },
        puck: RadiusInfo {
            radius: info.puck_radius,
        },
        mallet: RadiusInfo {
            radius: info.mallet_radius,
        },
        robot: RobotInfo {
            ee_desired_height: info.ee_desired_height,
            joint_pos_limit: info.joint_pos_limit,
            joint_vel_limit: info.joint_vel_limit,
            base_frame: info.base_frame.into_iter().map(BaseFrame::Flat).collect(),
        },
    }
}
