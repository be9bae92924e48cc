//! Runs the agent's program and talks to it over pipes, in the messages of the evaluator's protocol.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

struct RunningAgent {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl RunningAgent {
    fn start() -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_striker"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let input = child.stdin.take().expect("piped");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        Self {
            child,
            input,
            output,
        }
    }

    fn send(&mut self, message: &Value) {
        writeln!(self.input, "{message}").expect("the program reads");
    }

    /// Sends a message and returns the answer.
    fn ask(&mut self, message: &Value) -> Value {
        self.send(message);
        let mut line = String::new();
        self.output
            .read_line(&mut line)
            .expect("the program answers");
        serde_json::from_str(&line).expect("an answer in JSON")
    }
}

/// The message that starts an agent for `task`.
fn hello(task: &str) -> Value {
    let position = [
        2.967_06, 2.0944, 2.967_06, 2.0944, 2.967_06, 2.0944, 3.054_33,
    ];
    let velocity = [85.0_f64, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0].map(f64::to_radians);
    let symmetric = |limit: [f64; 7]| json!([limit.map(|v| -v), limit]);
    json!({"type": "hello", "protocol": 1, "task": task, "agent_id": 1, "env": {
        "dt": 0.02, "n_agents": 1,
        "puck_pos_ids": [0, 1, 2], "puck_vel_ids": [3, 4, 5],
        "joint_pos_ids": [6, 7, 8, 9, 10, 11, 12], "joint_vel_ids": [13, 14, 15, 16, 17, 18, 19],
        "opponent_ee_ids": [],
        "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
        "puck": {"radius": 0.03165}, "mallet": {"radius": 0.04815},
        "robot": {
            "n_joints": 7, "ee_desired_height": 0.1645, "universal_height": 0.0645, "control_frequency": 50.0,
            "joint_pos_limit": symmetric(position), "joint_vel_limit": symmetric(velocity),
            "joint_acc_limit": symmetric(velocity.map(|v| 10.0 * v)),
            "base_frame": [[[1.0, 0.0, 0.0, -1.51], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.1], [0.0, 0.0, 0.0, 1.0]]],
        },
        "episode_steps": 500, "ruleset": "airhockey-2023.3",
    }})
}

/// The first `length` numbers of an observation: puck, joint positions and velocities, opponent's mallet.
fn observation(length: usize) -> Vec<f64> {
    let mut observation = vec![1.1, 0.1, 0.0, -0.1, 0.0, 0.0];
    observation.extend([0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]);
    observation.extend([0.0; 7]);
    observation.extend([2.37, 0.0, 0.1645]);
    observation.truncate(length);
    observation
}

#[test]
fn agent_answers_from_hello_to_bye() {
    for (task, length) in [
        ("hit", 23),
        ("defend", 20),
        ("prepare", 20),
        ("tournament", 23),
    ] {
        let mut agent = RunningAgent::start();
        let ready = agent.ask(&hello(task));
        assert_eq!(ready["type"], "ready");
        assert_eq!(ready["protocol"], 1);
        assert_eq!(ready["interpolation"], 3);
        for episode in 0..2 {
            let ready = agent.ask(&json!({"type": "reset", "episode": episode}));
            assert_eq!(ready, json!({"type": "ready", "episode": episode}));
            for step in 0..30 {
                let act =
                    agent.ask(&json!({"type": "step", "step": step, "obs": observation(length)}));
                assert_eq!(act["type"], "act");
                assert_eq!(act["step"], step);
                let action: Vec<Vec<f64>> =
                    serde_json::from_value(act["action"].clone()).expect("an array");
                assert_eq!(action.iter().map(Vec::len).collect::<Vec<_>>(), [7, 7]);
                assert!(action.iter().flatten().all(|x| x.is_finite()));
            }
            agent.send(&json!({"type": "end", "episode": episode, "steps": 30}));
        }
        agent.send(&json!({"type": "bye"}));
        assert!(agent.child.wait().expect("the program ends").success());
    }
}

#[test]
fn invalid_message_ends_program_with_reason_on_stderr() {
    let mut agent = RunningAgent::start();
    agent.send(&json!({"type": "dance"}));
    drop(agent.input);
    let output = agent.child.wait_with_output().expect("the program ends");
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("expected a message of the protocol"));
}
