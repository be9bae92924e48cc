//! Compares the kinematics with a recording of the reference simulator, MuJoCo.

use super::*;
use serde_json::Value;
use std::io::Read;

/// Largest difference from the reference, metres and metres per radian.
const TOLERANCE: f64 = 1e-6;

/// Joint angles (`q`) with the reference's positions and Jacobian.
fn recording() -> Value {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/kinematics.json.gz"
    );
    let file = std::fs::File::open(path).expect("the recording is part of the repository");
    let mut text = String::new();
    flate2::read::GzDecoder::new(file)
        .read_to_string(&mut text)
        .expect("gzip");
    serde_json::from_str(&text).expect("JSON")
}

/// The numbers of nested arrays, in order.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().expect("a number")],
    }
}

#[test]
fn positions_and_jacobian_match_the_reference() {
    let recording = recording();
    let cases = recording["fk"].as_array().expect("cases");
    assert!(cases.len() >= 200);
    for case in cases {
        let pose = forward(&Joints::from_column_slice(&numbers(&case["q"])));
        let tip = numbers(&case["pos_ee"]);
        for i in 0..3 {
            assert!(
                (pose.tip[i] - tip[i]).abs() < TOLERANCE,
                "end effector {:?}, expected {tip:?}",
                pose.tip
            );
        }
        assert!((pose.elbow_z - numbers(&case["pos_4"])[2]).abs() < TOLERANCE);
        assert!((pose.wrist_z - numbers(&case["pos_7"])[2]).abs() < TOLERANCE);
        let jacobian = numbers(&case["jac_ee"]);
        for row in 0..3 {
            for joint in 0..JOINTS {
                assert!(
                    (pose.jacobian[(row, joint)] - jacobian[row * JOINTS + joint]).abs()
                        < TOLERANCE
                );
            }
        }
    }
}
