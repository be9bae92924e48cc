//! Talks to the agent as the evaluator does. Add tests for your own agent here.

use crate::{AGENT_INFO, mallet::forward, policy::Policy};
use faceoff_agent::serve;
use serde_json::{Value, json};

/// Joint positions at the start of an episode, rad.
const INITIAL_POSE: [f64; 7] = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0];
/// Speed limits of the joints, degrees/s.
const VELOCITY_LIMIT_DEGREES: [f64; 7] = [85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0];

/// The evaluator's first message: metres, radians, seconds.
fn hello() -> Value {
    let position_limit = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433];
    let velocity_limit = VELOCITY_LIMIT_DEGREES.map(f64::to_radians);
    let range = |limit: [f64; 7]| json!([limit.map(|x| -x), limit]);
    json!({"type": "hello", "protocol": 1, "task": "defend", "agent_id": 1, "env": {
        "dt": 0.02,
        "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
        "puck": {"radius": 0.03165},
        "mallet": {"radius": 0.04815},
        "robot": {
            "ee_desired_height": 0.1645,
            "base_frame": [[[1, 0, 0, -1.51], [0, 1, 0, 0], [0, 0, 1, -0.1], [0, 0, 0, 1]]],
            "joint_pos_limit": range(position_limit),
            "joint_vel_limit": range(velocity_limit),
        },
    }})
}

/// The agent's answers to `hello` and `reset`, and then to these puck states (x, y, yaw and their velocities), one per control
/// step.
fn answers(pucks: &[[f64; 6]]) -> Vec<Value> {
    let mut messages = vec![hello(), json!({"type": "reset", "episode": 0})];
    for (step, puck) in pucks.iter().enumerate() {
        let observation = [&puck[..], &INITIAL_POSE, &[0.0; 7]].concat();
        messages.push(json!({"type": "step", "step": step, "obs": observation}));
    }
    messages.push(json!({"type": "bye"}));
    let lines: Vec<String> = messages.iter().map(Value::to_string).collect();
    let mut output = Vec::new();
    serve(
        AGENT_INFO,
        |hello| Policy::new(&hello.env),
        lines.join("\n").as_bytes(),
        &mut output,
    )
    .expect("the agent responds");
    let text = String::from_utf8(output).expect("UTF-8");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

#[test]
fn agent_speaks_the_protocol() {
    let answers = answers(&[[1.0, 0.1, 0.0, -1.0, 0.0, 0.0]; 9]);
    let kinds: Vec<&str> = answers
        .iter()
        .filter_map(|answer| answer["type"].as_str())
        .collect();
    assert_eq!(kinds, [vec!["ready"; 2], vec!["act"; 9]].concat());
}

#[test]
fn agent_keeps_its_limits() {
    // The puck jumps and races; the numbers are arbitrary.
    let pucks: Vec<[f64; 6]> = (0..1000)
        .map(|step| {
            let phase = f64::from(step / 20);
            let (x, y) = (1.5 + 0.9 * (7.0 * phase).sin(), 0.48 * (11.0 * phase).sin());
            [
                x,
                y,
                0.0,
                3.0 * (5.0 * phase).sin(),
                3.0 * (3.0 * phase).sin(),
                0.0,
            ]
        })
        .collect();
    let mut last_pose = INITIAL_POSE;
    for answer in &answers(&pucks)[2..] {
        let [pose, speeds]: [[f64; 7]; 2] =
            serde_json::from_value(answer["action"].clone()).expect("positions and velocities");
        for joint in 0..7 {
            // The rules allow 95 % of a joint's speed limit.
            let limit = 0.95 * VELOCITY_LIMIT_DEGREES[joint].to_radians();
            assert!(speeds[joint].abs() < limit, "joint {joint}");
            assert!(
                (pose[joint] - last_pose[joint]).abs() < 0.02 * limit,
                "joint {joint}"
            );
        }
        // The whole mallet stays on the table. The base is 1.51 m from the table's centre, so in its frame the table begins at
        // x = 1.51 - 0.974. The table's half width is 0.519, the mallet's radius 0.04815.
        let [x, y] = forward(&pose);
        assert!(
            x > 1.51 - 0.974 + 0.04815 && y.abs() < 0.519 - 0.04815,
            "{x} {y}"
        );
        last_pose = pose;
    }
}
