//! `faceoff sim golden`, which prints hashes of reference episodes and games of the simulator.

use std::process::Command;

const GOLDEN: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/simulator.txt"
));

#[test]
fn sim_golden_prints_the_golden_file() {
    let output = Command::new(env!("CARGO_BIN_EXE_faceoff"))
        .args(["sim", "golden"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(String::from_utf8(output.stdout).unwrap(), GOLDEN);
}
