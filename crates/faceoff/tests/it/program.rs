//! Runs the program under test; configurations, agents and helpers that several tests use.

use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A configuration with generous time limits, so that a busy machine causes no agent faults.
pub const LONG_TIME_LIMITS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/long_time_limits.toml"
);
/// An arbitrary seed, which fixes the episodes.
pub const SEED: &str = "5";

/// A command of the program with these arguments, to which a test can add.
pub fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_faceoff"));
    command.args(args);
    command
}

pub fn faceoff(args: &[&str]) -> Output {
    command(args).output().unwrap()
}

/// Runs the program in a working folder.
pub fn faceoff_in(folder: &Path, args: &[&str]) -> Output {
    command(args).current_dir(folder).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The folder of an example agent.
pub fn agent(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../agents")
        .join(name)
}

/// The example agent that keeps its arm still.
pub fn hold() -> PathBuf {
    agent("hold")
}

pub fn read_json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

/// The names of the files and folders in a folder, sorted.
pub fn file_names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
