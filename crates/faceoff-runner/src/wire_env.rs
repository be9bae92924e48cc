//! The field `env` of the message `hello`: the simulator's constants, as an agent gets them.

use faceoff_sim::{AirHockeyTask, EPISODE_STEPS, EnvInfo, env_info, env_info_for};
use faceoff_types::{AgentTask, GAME_WINDOWS, RULESET, UnknownTask, WINDOW_STEPS};
use faceoff_wire::{
    Env,
    message::{DiscEnv, RobotEnv, TableEnv},
};

/// The simulator's constants under the protocol's names.
///
/// # Errors
/// If the simulator has no such task.
pub(crate) fn wire_env(agent_task: AgentTask) -> Result<Env, UnknownTask> {
    let (info, episode_steps, has_opponent) = match agent_task {
        AgentTask::Qualifying(task) => {
            let task = task.try_into()?;
            (env_info(task), EPISODE_STEPS, task == AirHockeyTask::Hit)
        }
        AgentTask::Game { side } => {
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
        &Env::OPPONENT_EE_IDS
    } else {
        &[]
    };
    Ok(Env {
        dt,
        n_agents,
        puck_pos_ids: Env::PUCK_POS_IDS.to_vec(),
        puck_vel_ids: Env::PUCK_VEL_IDS.to_vec(),
        joint_pos_ids: Env::JOINT_POS_IDS.to_vec(),
        joint_vel_ids: Env::JOINT_VEL_IDS.to_vec(),
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
            n_joints: faceoff_sim::JOINTS,
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
        ruleset: RULESET.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_airhockey::{DEFEND, HIT, PREPARE};
    use faceoff_types::Side;
    use faceoff_wire::Message;
    use serde_json::json;

    #[test]
    fn hello_contains_the_rules_constants() {
        let env = serde_json::to_value(wire_env(HIT.into()).unwrap()).unwrap();
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
            assert_eq!(
                wire_env(task.into()).unwrap().opponent_ee_ids,
                [] as [usize; 0]
            );
        }
    }

    #[test]
    fn game_hello_has_the_side_and_its_own_frame_first() {
        for (side, agent_id, own_x) in [(Side::First, 1, -1.51), (Side::Second, 2, 1.51)] {
            let agent_task = AgentTask::Game { side };
            let hello = Message::hello(agent_task, wire_env(agent_task).unwrap());
            let hello = serde_json::to_value(hello).unwrap();
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
        let agent_task = AgentTask::Qualifying(DEFEND);
        let hello = Message::hello(agent_task, wire_env(agent_task).unwrap());
        assert_eq!(quoted, serde_json::to_value(hello).unwrap());
    }
}
