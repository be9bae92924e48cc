//! Runs the program of an agent's bundle as a policy, over pipes and in the messages of the evaluator's protocol.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::Context;
use faceoff_sim::env_info_for;
use serde_json::{Value, json};
use striker::{Action, Policy, WrongLength};

/// A running agent program that has answered the message `hello`.
pub struct Program {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// Rallies begun.
    rally: u32,
    /// Control steps in the rally.
    step: u32,
}

impl Program {
    /// Starts the bundle in `folder` as the agent of the robot with index 0 or 1 in a game.
    pub fn start(folder: &Path, robot_index: usize) -> anyhow::Result<Self> {
        let manifest = std::fs::read_to_string(folder.join("agent.toml"))
            .with_context(|| format!("read {}", folder.join("agent.toml").display()))?;
        let manifest: toml::Table = manifest.parse()?;
        let command: Vec<&str> = manifest["command"]
            .as_array()
            .context("command: a list")?
            .iter()
            .filter_map(toml::Value::as_str)
            .collect();
        let (executable, arguments) = command.split_first().context("command: not empty")?;
        let mut child = Command::new(executable)
            .args(arguments)
            .current_dir(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("start {executable}"))?;
        let input = child.stdin.take().context("piped")?;
        let output = BufReader::new(child.stdout.take().context("piped")?);
        let mut program = Self {
            child,
            input,
            output,
            rally: 0,
            step: 0,
        };
        program.ask(&hello(robot_index));
        Ok(program)
    }

    /// Sends a message and returns the answer.
    fn ask(&mut self, message: &Value) -> Value {
        writeln!(self.input, "{message}").expect("the program reads");
        let mut line = String::new();
        self.output
            .read_line(&mut line)
            .expect("the program answers");
        serde_json::from_str(&line).expect("an answer in JSON")
    }
}

impl Policy for Program {
    fn reset(&mut self) {
        self.ask(&json!({"type": "reset", "episode": self.rally}));
        self.rally += 1;
        self.step = 0;
    }

    fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength> {
        let answer = self.ask(&json!({"type": "step", "step": self.step, "obs": observation}));
        self.step += 1;
        let action = answer["action"].clone();
        Ok(serde_json::from_value(action).expect("positions and velocities"))
    }

    fn describe(&self) -> String {
        format!("step {} of rally {}", self.step, self.rally)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // The program has no state to save, and may have ended already.
        let _killed = self.child.kill();
        let _reaped = self.child.wait();
    }
}

/// The message that starts an agent.
fn hello(robot_index: usize) -> Value {
    let info = env_info_for(2, robot_index);
    json!({"type": "hello", "protocol": 1, "task": "tournament", "agent_id": robot_index + 1, "env": {
        "dt": info.dt, "n_agents": info.n_agents,
        "puck_pos_ids": [0, 1, 2], "puck_vel_ids": [3, 4, 5],
        "joint_pos_ids": [6, 7, 8, 9, 10, 11, 12], "joint_vel_ids": [13, 14, 15, 16, 17, 18, 19],
        "opponent_ee_ids": [20, 21, 22],
        "table": {"length": info.table_length, "width": info.table_width, "goal_width": info.goal_width},
        "puck": {"radius": info.puck_radius}, "mallet": {"radius": info.mallet_radius},
        "robot": {
            "n_joints": 7, "ee_desired_height": info.ee_desired_height,
            "universal_height": info.universal_height, "control_frequency": info.control_frequency,
            "joint_pos_limit": info.joint_pos_limit, "joint_vel_limit": info.joint_vel_limit,
            "joint_acc_limit": info.joint_acc_limit, "base_frame": info.base_frame,
        },
        "ruleset": "airhockey-2023.3",
    }})
}
