//! Messages from the evaluator to an agent, one JSON object per line. An agent plays *episodes* of a qualifying task, or a game, which is a
//! sequence of *rallies*.

use crate::protocol::PROTOCOL_VERSION;
use faceoff_types::{AgentTask, JOINTS, Task};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A message to the agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Message<'a> {
    /// Sent once, as the first message; answered by `ready`.
    Hello {
        /// [`PROTOCOL_VERSION`].
        protocol: u32,
        /// The task, or `tournament` for a game.
        task: Task,
        /// 1, or 2 for the second side of a game.
        agent_id: u32,
        /// The constants of the simulation.
        env: Box<Env>,
    },
    /// Sent before each episode, and before each rally of a game; answered by `ready`.
    Reset {
        /// Index of the episode within the evaluation; in a game, number of the rally.
        episode: u32,
    },
    /// Sent for each control step (20 ms); answered by `act`.
    Step {
        /// Index of the step within the episode or rally, from 0.
        step: u32,
        /// The observation: 20 numbers, or 23 with an opponent on the table.
        obs: Cow<'a, [f64]>,
    },
    /// Sent after each episode or rally; not answered.
    End {
        /// Index of the episode, or number of the rally.
        episode: u32,
        /// Number of control steps played.
        steps: u32,
    },
    /// The last message; not answered.
    Bye,
}

impl<'a> Message<'a> {
    /// `hello` for the agent of a qualifying task, or for one of the two agents of a game.
    #[must_use]
    pub fn hello(agent_task: AgentTask, env: Env) -> Self {
        Self::Hello {
            protocol: PROTOCOL_VERSION,
            task: agent_task.name(),
            agent_id: agent_task.agent_id(),
            env: Box::new(env),
        }
    }

    /// `step`, borrowing the observation.
    #[must_use]
    pub fn step(step: u32, obs: &'a [f64]) -> Self {
        Self::Step {
            step,
            obs: Cow::Borrowed(obs),
        }
    }

    /// Replaces the content of `buffer` by the message's line, including the newline, reusing its memory.
    /// Numbers are written with enough digits to be read back to the same bits.
    ///
    /// Numbers must be finite: JSON has no others, and an infinity would be read as `null`.
    pub fn write_line(&self, buffer: &mut Vec<u8>) {
        buffer.clear();
        serde_json::to_writer(&mut *buffer, self)
            .expect("writing plain data to memory cannot fail");
        buffer.push(b'\n');
    }
}

/// `env` of `hello`: constants of the simulation, under the names of the challenge's `env_info`.
/// SI units, radians.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Env {
    /// Duration of a control step, seconds.
    pub dt: f64,
    /// Number of robots that agents control.
    pub n_agents: u32,
    /// Indices of the puck's x, y, yaw in an observation.
    pub puck_pos_ids: Vec<usize>,
    /// Indices of the rates of x, y and yaw in an observation.
    pub puck_vel_ids: Vec<usize>,
    /// Indices of the joint positions in an observation.
    pub joint_pos_ids: Vec<usize>,
    /// Indices of the filtered joint velocities in an observation.
    pub joint_vel_ids: Vec<usize>,
    /// Indices of x, y, z of the opponent's end effector in an observation; empty without an opponent.
    pub opponent_ee_ids: Vec<usize>,
    /// The playing surface and the goal mouths.
    pub table: TableEnv,
    /// The puck; its mass and friction are not disclosed.
    pub puck: DiscEnv,
    /// The mallet: the cylinder that strikes the puck.
    pub mallet: DiscEnv,
    /// The nominal robot, regardless of the profile's model mismatch.
    pub robot: RobotEnv,
    /// Maximum number of control steps of an episode.
    pub episode_steps: u32,
    /// The ruleset's name.
    pub ruleset: String,
}

/// Dimensions of the table, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TableEnv {
    /// Distance between the goal lines, along x.
    pub length: f64,
    /// Width of the playing surface, along y.
    pub width: f64,
    /// Width of a goal mouth, along y.
    pub goal_width: f64,
}

/// A round body on the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DiscEnv {
    /// Radius in metres.
    pub radius: f64,
}

/// The robot's constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotEnv {
    /// Number of driven joints.
    pub n_joints: usize,
    /// Height of the mallet plane in the robot's base frame, metres.
    pub ee_desired_height: f64,
    /// Height above the table of the universal joint, through which the mallet hangs on the arm, metres.
    pub universal_height: f64,
    /// Control steps per second.
    pub control_frequency: f64,
    /// Lower and upper joint limits, rad.
    pub joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper velocity limits, rad/s.
    pub joint_vel_limit: [[f64; JOINTS]; 2],
    /// Lower and upper acceleration limits, rad/s².
    pub joint_acc_limit: [[f64; JOINTS]; 2],
    /// Homogeneous transforms from the robot's base frame to the table's frame, row-major, one per robot, the agent's own first.
    pub base_frame: Vec<[[f64; 4]; 4]>,
}

impl Env {
    /// Indices of the puck's x, y, yaw.
    pub const PUCK_POS_IDS: [usize; 3] = [0, 1, 2];
    /// Indices of the rates of x, y, yaw.
    pub const PUCK_VEL_IDS: [usize; 3] = [3, 4, 5];
    /// Indices of the joint positions.
    pub const JOINT_POS_IDS: [usize; JOINTS] = [6, 7, 8, 9, 10, 11, 12];
    /// Indices of the joint velocities.
    pub const JOINT_VEL_IDS: [usize; JOINTS] = [13, 14, 15, 16, 17, 18, 19];
    /// Indices of x, y, z of the opponent's end effector, if there is an opponent.
    pub const OPPONENT_EE_IDS: [usize; 3] = [20, 21, 22];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(message: &Message<'_>) -> String {
        let mut buffer = b"previous line".to_vec();
        message.write_line(&mut buffer);
        String::from_utf8(buffer).unwrap()
    }

    #[test]
    fn messages_are_written_as_in_the_protocol() {
        assert_eq!(
            line(&Message::Reset { episode: 17 }),
            "{\"type\":\"reset\",\"episode\":17}\n"
        );
        assert_eq!(
            line(&Message::step(0, &[0.25, -1.0])),
            "{\"type\":\"step\",\"step\":0,\"obs\":[0.25,-1.0]}\n"
        );
        assert_eq!(
            line(&Message::End {
                episode: 17,
                steps: 133
            }),
            "{\"type\":\"end\",\"episode\":17,\"steps\":133}\n"
        );
        assert_eq!(line(&Message::Bye), "{\"type\":\"bye\"}\n");
    }

    #[test]
    fn observation_numbers_keep_their_bits() {
        let obs = [
            0.1 + 0.2,
            -0.0,
            f64::MIN_POSITIVE / 3.0,
            1e300,
            std::f64::consts::PI,
        ];
        let text = line(&Message::step(3, &obs));
        let Message::Step { obs: obs_read, .. } = serde_json::from_str(&text).unwrap() else {
            panic!("not a step: {text}");
        };
        assert_eq!(
            obs_read.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            obs.map(f64::to_bits)
        );
    }
}
