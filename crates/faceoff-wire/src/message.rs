//! What the evaluator says to an agent, one JSON object per line.

use crate::protocol::PROTOCOL_VERSION;
use faceoff_types::{Contest, JOINTS, Task};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What an agent may be asked to play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProtocolTask {
    /// Score a goal.
    Hit,
    /// Stop an incoming puck.
    Defend,
    /// Bring the puck into a good position.
    Prepare,
    /// A game against another agent.
    Tournament,
}

impl From<Contest> for ProtocolTask {
    fn from(contest: Contest) -> Self {
        match contest {
            Contest::Task(Task::Hit) => Self::Hit,
            Contest::Task(Task::Defend) => Self::Defend,
            Contest::Task(Task::Prepare) => Self::Prepare,
            Contest::Game { .. } => Self::Tournament,
        }
    }
}

/// A message to the agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Message<'a> {
    /// Once, first; answered by `ready`.
    Hello {
        /// [`PROTOCOL_VERSION`].
        protocol: u32,
        /// What is played.
        task: ProtocolTask,
        /// 1, or 2 for the second side of a game.
        agent_id: u32,
        /// The constants of the simulation.
        env: Box<Env>,
    },
    /// Before each episode; answered by `ready`.
    Reset {
        /// Index of the episode within the evaluation.
        episode: u32,
    },
    /// One control step; answered by `act`.
    Step {
        /// Index of the step within the episode, from 0.
        step: u32,
        /// The observation: 20 numbers, or 23 with an opponent on the table.
        obs: Cow<'a, [f64]>,
    },
    /// The episode is over; not answered.
    End {
        /// Index of the episode.
        episode: u32,
        /// Control steps played.
        steps: u32,
    },
    /// The last message; not answered.
    Bye,
}

impl<'a> Message<'a> {
    /// `hello` for the one agent of a qualifying task, or one of the two of a game.
    #[must_use]
    pub fn hello(contest: Contest, env: Env) -> Self {
        Self::Hello {
            protocol: PROTOCOL_VERSION,
            task: contest.into(),
            agent_id: contest.agent_id(),
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

    /// Replaces `buffer` by the message's line, newline included. The buffer's memory is reused;
    /// numbers are written with as many digits as read back to the same bits.
    ///
    /// Numbers must be finite: JSON has no others, and an infinity would read as `null`.
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
    /// Duration of a control step.
    pub dt: f64,
    /// Robots on the table that agents control.
    pub n_agents: u32,
    /// Where the puck's x, y, yaw are in an observation.
    pub puck_pos_ids: Vec<usize>,
    /// Where the puck's velocities are in an observation.
    pub puck_vel_ids: Vec<usize>,
    /// Where the joint positions are in an observation.
    pub joint_pos_ids: Vec<usize>,
    /// Where the filtered joint velocities are in an observation.
    pub joint_vel_ids: Vec<usize>,
    /// Where the opponent's end effector is in an observation; empty without an opponent.
    pub opponent_ee_ids: Vec<usize>,
    /// Playing surface and goal mouths.
    pub table: TableEnv,
    /// Mass and friction are not told.
    pub puck: DiscEnv,
    /// The striking cylinder.
    pub mallet: DiscEnv,
    /// Always the nominal one, whatever the profile does to the plant.
    pub robot: RobotEnv,
    /// Control steps after which an episode ends at the latest.
    pub episode_steps: u32,
    /// The ruleset's name.
    pub ruleset: String,
}

/// Dimensions of the table, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TableEnv {
    /// Along x, from goal line to goal line.
    pub length: f64,
    /// Along y.
    pub width: f64,
    /// Of the goal mouth, along y.
    pub goal_width: f64,
}

/// A round body on the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DiscEnv {
    /// In metres.
    pub radius: f64,
}

/// The robot's constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotEnv {
    /// Driven joints.
    pub n_joints: usize,
    /// Height of the mallet plane in the robot's base frame, metres.
    pub ee_desired_height: f64,
    /// Height of the universal joint above the table, metres.
    pub universal_height: f64,
    /// Control steps per second.
    pub control_frequency: f64,
    /// Lower and upper joint limits, rad.
    pub joint_pos_limit: [[f64; JOINTS]; 2],
    /// Lower and upper velocity limits, rad/s.
    pub joint_vel_limit: [[f64; JOINTS]; 2],
    /// Lower and upper acceleration limits, rad/s².
    pub joint_acc_limit: [[f64; JOINTS]; 2],
    /// `table_from_robot`, homogeneous and row-major, one per robot, the agent's own first.
    pub base_frame: Vec<[[f64; 4]; 4]>,
}

impl Env {
    /// Indices of the puck's x, y, yaw.
    pub const PUCK_POS_IDS: [usize; 3] = [0, 1, 2];
    /// Indices of the puck's velocities.
    pub const PUCK_VEL_IDS: [usize; 3] = [3, 4, 5];
    /// Indices of the joint positions.
    pub const JOINT_POS_IDS: [usize; JOINTS] = [6, 7, 8, 9, 10, 11, 12];
    /// Indices of the joint velocities.
    pub const JOINT_VEL_IDS: [usize; JOINTS] = [13, 14, 15, 16, 17, 18, 19];
    /// Indices of the opponent's end effector, where there is an opponent.
    pub const OPPONENT_EE_IDS: [usize; 3] = [20, 21, 22];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(message: &Message<'_>) -> String {
        let mut buffer = b"left over".to_vec();
        message.write_line(&mut buffer);
        String::from_utf8(buffer).unwrap()
    }

    #[test]
    fn lines_are_those_of_the_protocol() {
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
    fn numbers_come_back_with_the_same_bits() {
        let obs = [
            0.1 + 0.2,
            -0.0,
            f64::MIN_POSITIVE / 3.0,
            1e300,
            std::f64::consts::PI,
        ];
        let text = line(&Message::step(3, &obs));
        let Message::Step { obs: back, .. } = serde_json::from_str(&text).unwrap() else {
            panic!("not a step: {text}");
        };
        assert_eq!(
            back.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            obs.map(f64::to_bits)
        );
    }
}
