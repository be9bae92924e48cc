//! `faceoff sim golden`, which prints hashes of reference episodes and games of the simulator.

use crate::program::command;

const GOLDEN: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/simulator.txt"
));

#[test]
fn sim_golden_prints_the_golden_file() {
    let output = command(&["sim", "golden"]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(String::from_utf8(output.stdout).unwrap(), GOLDEN);
}
