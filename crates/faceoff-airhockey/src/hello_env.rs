//! The field `env` of the message `hello`: the simulator's constants, as an agent gets them.

use crate::RULESET;
use faceoff_sim::{AirHockeyTask, EPISODE_STEPS, EnvInfo, JOINTS, env_info, env_info_for};
use faceoff_types::{AgentTask, GAME_WINDOWS, UnknownTask, WINDOW_STEPS};
use serde::Serialize;

/// `env` of `hello`: constants of the simulation, under the names of the `env_info` of the 2023 Robot Air Hockey Challenge.
/// SI units, radians.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct HelloEnv {
    /// Duration of a control step, seconds.
    dt: f64,
    /// Number of robots that agents control.
    n_agents: u32,
    /// Indices of the puck's x, y, yaw in an observation.
    puck_pos_ids: Vec<usize>,
    /// Indices of the rates of x, y and yaw in an observation.
    puck_vel_ids: Vec<usize>,
    /// Indices of the joint positions in an observation.
    joint_pos_ids: Vec<usize>,
    /// Indices of the filtered joint velocities in an observation.
    joint_vel_ids: Vec<usize>,
    /// Indices of x, y, z of the opponent's end effector in an observation; empty without an opponent.
    opponent_ee_ids: Vec<usize>,
    /// The playing surface and the goal mouths.
    table: TableEnv,
    /// The puck; its mass and friction are not disclosed.
    puck: DiscEnv,
    /// The mallet: the cylinder that strikes the puck.
    mallet: DiscEnv,
    /// The nominal robot, regardless of the profile's model mismatch.
    robot: RobotEnv,
    /// Maximum number of control steps of an episode.
    episode_steps: u32,
    /// The ruleset's name.
    ruleset: String,
}

/// Dimensions of the table, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct TableEnv {
    /// Distance between the goal lines, along x.
    length: f64,
    /// Width of the playing surface, along y.
    width: f64,
    /// Width of a goal mouth, along y.
    goal_width: f64,
}

/// A round body on the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct DiscEnv {
    /// Radius in metres.
    radius: f64,
}

/// The robot's constants.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct RobotEnv {
    /// Number of driven joints.
    n_joints: usize,
    /// Height of the mallet plane in the robot's base frame, metres.
    ee_desired_height: f64,
    /// Height above the table of the universal joint, through which the mallet hangs on the arm, metres.
    universal_height: f64,
    /// Control steps per second.
    control_frequency: f64,
    /// Lower and upper joint limits, rad.
    joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper velocity limits, rad/s.
    joint_vel_limit: [[f64; JOINTS]; 2],
    /// Lower and upper acceleration limits, rad/s².
    joint_acc_limit: [[f64; JOINTS]; 2],
    /// Homogeneous transforms from the robot's base frame to the table's frame, row-major, one per robot, the agent's own first.
    base_frame: Vec<[[f64; 4]; 4]>,
}

impl HelloEnv {
    /// Indices of the puck's x, y, yaw.
    const PUCK_POS_IDS: [usize; 3] = [0, 1, 2];
    /// Indices of the rates of x, y, yaw.
    const PUCK_VEL_IDS: [usize; 3] = [3, 4, 5];
    /// Indices of the joint positions.
    const JOINT_POS_IDS: [usize; JOINTS] = [6, 7, 8, 9, 10, 11, 12];
    /// Indices of the joint velocities.
    const JOINT_VEL_IDS: [usize; JOINTS] = [13, 14, 15, 16, 17, 18, 19];
    /// Indices of x, y, z of the opponent's end effector, if there is an opponent.
    const OPPONENT_EE_IDS: [usize; 3] = [20, 21, 22];
}

/// The simulator's constants under the protocol's names.
///
/// # Errors
/// If the simulator has no such task.
pub(crate) fn hello_env(agent_task: AgentTask) -> Result<HelloEnv, UnknownTask> {
    let (info, episode_steps, has_opponent) = match agent_task {
        AgentTask::Episodes(task) => {
            let task = task.try_into()?;
            (env_info(task), EPISODE_STEPS, task == AirHockeyTask::Hit)
        }
        AgentTask::Game { side } => {
            // A window is a stretch of 500 control steps, in which each kind of violation counts at most once.
            let steps = GAME_WINDOWS * WINDOW_STEPS;
            (env_info_for(2, side.index()), steps, true)
        }
    };
    let EnvInfo {
        n_agents,
        table_length,
        table_width,
        goal_width,
        puck_radius,
        mallet_radius,
        ee_desired_height,
        universal_height,
        control_frequency,
        joint_pos_limit,
        joint_vel_limit,
        joint_acc_limit,
        base_frame,
        dt,
    } = info;
    let opponent: &[usize] = if has_opponent {
        &HelloEnv::OPPONENT_EE_IDS
    } else {
        &[]
    };
    Ok(HelloEnv {
        dt,
        n_agents,
        puck_pos_ids: HelloEnv::PUCK_POS_IDS.to_vec(),
        puck_vel_ids: HelloEnv::PUCK_VEL_IDS.to_vec(),
        joint_pos_ids: HelloEnv::JOINT_POS_IDS.to_vec(),
        joint_vel_ids: HelloEnv::JOINT_VEL_IDS.to_vec(),
        opponent_ee_ids: opponent.to_vec(),
        table: TableEnv {
            length: table_length,
            width: table_width,
            goal_width,
        },
        puck: DiscEnv {
            radius: puck_radius,
        },
        mallet: DiscEnv {
            radius: mallet_radius,
        },
        robot: RobotEnv {
            n_joints: JOINTS,
            ee_desired_height,
            universal_height,
            control_frequency,
            joint_pos_limit,
            joint_vel_limit,
            joint_acc_limit,
            // Each frame is a 4×4 matrix, stored row by row as 16 numbers.
            base_frame: base_frame
                .iter()
                .map(|matrix| {
                    let row = |start: usize| {
                        [
                            matrix[start],
                            matrix[start + 1],
                            matrix[start + 2],
                            matrix[start + 3],
                        ]
                    };
                    [0, 4, 8, 12].map(row)
                })
                .collect(),
        },
        episode_steps,
        ruleset: RULESET.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DEFEND, HIT, PREPARE};
    use faceoff_types::Side;
    use faceoff_wire::Message;
    use serde_json::{Value, json, value::to_raw_value};

    /// The message as agents get it.
    fn hello(agent_task: AgentTask) -> Value {
        let env = to_raw_value(&hello_env(agent_task).unwrap()).unwrap();
        let mut line = Vec::new();
        Message::hello(agent_task, &env).write_line(&mut line);
        serde_json::from_slice(&line).unwrap()
    }

    #[test]
    fn hello_contains_the_rules_constants() {
        let env = &hello(HIT.into())["env"];
        assert_eq!(env["dt"], 0.02);
        assert_eq!(env["episode_steps"], 500);
        assert_eq!(env["table"]["length"], 1.948);
        assert_eq!(env["table"]["width"], 1.038);
        assert_eq!(env["table"]["goal_width"], 0.25);
        assert_eq!(env["puck"]["radius"], 0.03165);
        assert_eq!(env["mallet"]["radius"], 0.04815);
        assert_eq!(env["robot"]["ee_desired_height"], 0.1645);
        assert_eq!(env["robot"]["universal_height"], 0.0645);
        assert_eq!(env["robot"]["control_frequency"], 50.0);
        assert_eq!(env["robot"]["n_joints"], 7);
        assert_eq!(env["opponent_ee_ids"], serde_json::json!([20, 21, 22]));
        assert_eq!(
            env["robot"]["base_frame"][0][0],
            serde_json::json!([1.0, 0.0, 0.0, -1.51])
        );
        for task in [DEFEND, PREPARE] {
            assert_eq!(hello(task.into())["env"]["opponent_ee_ids"], json!([]));
        }
    }

    #[test]
    fn game_hello_has_agent_id_and_own_base_frame_first() {
        for (side, agent_id, own_x) in [(Side::First, 1, -1.51), (Side::Second, 2, 1.51)] {
            let agent_task = AgentTask::Game { side };
            let hello = hello(agent_task);
            assert_eq!(hello["task"], "tournament");
            assert_eq!(hello["agent_id"], agent_id);
            let env = &hello["env"];
            assert_eq!(
                (&env["n_agents"], &env["episode_steps"]),
                (&json!(2), &json!(45_000))
            );
            assert_eq!(env["opponent_ee_ids"], json!([20, 21, 22]));
            assert_eq!(env["robot"]["base_frame"][0][0][3], own_x);
            assert_eq!(env["robot"]["base_frame"][1][0][3], -own_x);
        }
    }

    #[test]
    fn documented_hello_matches_the_code() {
        let document = include_str!("../../../docs/robot.md");
        let (_, rest) = document.split_once("```json\n").expect("a block of JSON");
        let (quoted, _) = rest.split_once("```").expect("the block's end");
        let quoted: serde_json::Value = serde_json::from_str(quoted).expect("JSON");
        let agent_task = AgentTask::Episodes(DEFEND);
        assert_eq!(quoted, hello(agent_task));
    }
}
