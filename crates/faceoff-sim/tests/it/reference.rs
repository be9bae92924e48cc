//! Reads the recordings of the *reference*, the simulator of the 2023 Robot Air Hockey Challenge (`tests/reference/`), and compares lists
//! of numbers.

use serde_json::Value;
use std::{fs::File, io::Read, path::Path};

/// Reads a recording by its name without extension.
pub fn recording(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/reference")
        .join(format!("{name}.json.gz"));
    let mut text = String::new();
    flate2::read::GzDecoder::new(File::open(path).unwrap())
        .read_to_string(&mut text)
        .unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The cases of a recording.
pub fn cases(name: &str) -> Vec<Value> {
    recording(name)["cases"].as_array().unwrap().clone()
}

/// All numbers of a nested array, in order.
pub fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// An array of fixed length.
pub fn array<const N: usize>(value: &Value) -> [f64; N] {
    flat(value).try_into().unwrap()
}

/// An array of arrays.
pub fn rows<const N: usize>(value: &Value) -> Vec<[f64; N]> {
    value.as_array().unwrap().iter().map(array).collect()
}

/// Largest difference of two lists.
pub fn max_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// A quantile of a list, e.g. the median for `q` = 0.5. Sorts the list.
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}
