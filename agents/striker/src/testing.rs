//! The environment description `env` for unit tests: the table and robot of the competition.

use crate::Env;

/// The `env` that the evaluator sends in the message `hello`.
pub fn env() -> Env {
    let position = [
        2.967_06, 2.0944, 2.967_06, 2.0944, 2.967_06, 2.0944, 3.054_33,
    ];
    let velocity = [85.0_f64, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0].map(f64::to_radians);
    let env = serde_json::json!({
        "dt": 0.02,
        "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
        "puck": {"radius": 0.03165},
        "mallet": {"radius": 0.04815},
        "robot": {
            "ee_desired_height": 0.1645,
            "joint_pos_limit": [position.map(|x| -x), position],
            "joint_vel_limit": [velocity.map(|x| -x), velocity],
            "base_frame": [[[1.0, 0.0, 0.0, -1.51], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.1], [0.0, 0.0, 0.0, 1.0]]],
        },
    });
    serde_json::from_value(env).expect("a complete environment")
}
