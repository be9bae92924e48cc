//! Speaks with the agent as the evaluator does. Add what your agent shall keep to.

use crate::{ABOUT, mallet::forward, policy::Policy};
use faceoff_agent::serve;
use serde_json::{Value, json};

const POSE: [f64; 7] = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0];
const VELOCITY_LIMIT_DEGREES: [f64; 7] = [85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0];

fn hello() -> Value {
    let position = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433];
    let velocity = VELOCITY_LIMIT_DEGREES.map(f64::to_radians);
    let both = |limit: [f64; 7]| json!([limit.map(|x| -x), limit]);
    json!({"type": "hello", "protocol": 1, "task": "defend", "agent_id": 1, "env": {
        "dt": 0.02,
        "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
        "puck": {"radius": 0.03165},
        "mallet": {"radius": 0.04815},
        "robot": {
            "ee_desired_height": 0.1645,
            "base_frame": [[[1, 0, 0, -1.51], [0, 1, 0, 0], [0, 0, 1, -0.1], [0, 0, 0, 1]]],
            "joint_pos_limit": both(position),
            "joint_vel_limit": both(velocity),
        },
    }})
}

/// What it answers to these pucks, one per control step.
fn answers(pucks: &[[f64; 6]]) -> Vec<Value> {
    let mut questions = vec![hello(), json!({"type": "reset", "episode": 17})];
    for (step, puck) in pucks.iter().enumerate() {
        let observation = [&puck[..], &POSE, &[0.0; 7]].concat();
        questions.push(json!({"type": "step", "step": step, "obs": observation}));
    }
    questions.push(json!({"type": "bye"}));
    let lines: Vec<String> = questions.iter().map(Value::to_string).collect();
    let mut output = Vec::new();
    serve(
        ABOUT,
        |hello| Policy::new(&hello.env),
        lines.join("\n").as_bytes(),
        &mut output,
    )
    .expect("it answers");
    let text = String::from_utf8(output).expect("UTF-8");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

#[test]
fn speaks_the_protocol_from_hello_to_bye() {
    let said = answers(&[[1.0, 0.1, 0.0, -1.0, 0.0, 0.0]; 9]);
    let kinds: Vec<&str> = said
        .iter()
        .filter_map(|answer| answer["type"].as_str())
        .collect();
    assert_eq!(kinds, [vec!["ready"; 2], vec!["act"; 9]].concat());
}

#[test]
fn keeps_its_limits_whatever_the_puck_does() {
    // Pucks that jump about and race; the numbers only have to differ.
    let pucks: Vec<[f64; 6]> = (0..1000)
        .map(|step| {
            let place = f64::from(step / 20);
            let (x, y) = (1.5 + 0.9 * (7.0 * place).sin(), 0.48 * (11.0 * place).sin());
            [
                x,
                y,
                0.0,
                3.0 * (5.0 * place).sin(),
                3.0 * (3.0 * place).sin(),
                0.0,
            ]
        })
        .collect();
    let mut last = POSE;
    for answer in &answers(&pucks)[2..] {
        let [pose, speeds]: [[f64; 7]; 2] =
            serde_json::from_value(answer["action"].clone()).expect("positions and velocities");
        for joint in 0..7 {
            let limit = 0.95 * VELOCITY_LIMIT_DEGREES[joint].to_radians();
            assert!(speeds[joint].abs() < limit, "joint {joint}");
            assert!(
                (pose[joint] - last[joint]).abs() < 0.02 * limit,
                "joint {joint}"
            );
        }
        let [x, y] = forward(&pose);
        assert!(
            x > 1.51 - 0.974 + 0.04815 && y.abs() < 0.519 - 0.04815,
            "{x} {y}"
        );
        last = pose;
    }
}
