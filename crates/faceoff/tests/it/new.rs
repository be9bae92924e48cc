//! What `faceoff new` makes: it runs as it is, and plays.

use crate::PATIENT;
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const FACEOFF: &str = env!("CARGO_BIN_EXE_faceoff");

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn run(program: &str, args: &[&str], folder: &Path) -> Output {
    Command::new(program)
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn succeed(program: &str, args: &[&str], folder: &Path) -> String {
    let output = run(program, args, folder);
    assert!(
        output.status.success(),
        "{program} {args:?}: {}{}",
        text(&output.stdout),
        text(&output.stderr)
    );
    text(&output.stdout)
}

/// Success rate and penalty points but for computation time, of some episodes in the evaluation profile.
fn played(bundle: &Path, task: &str) -> (f64, u64) {
    let (folder, bundle) = (bundle.parent().unwrap(), bundle.to_str().unwrap());
    let args = [
        "eval",
        bundle,
        "--task",
        task,
        "--episodes",
        "20",
        "--seed",
        "1",
        "--workers",
        "2",
        "--config",
        PATIENT,
        "--out",
        "result",
    ];
    succeed(FACEOFF, &args, folder);
    let results = fs::read(folder.join("result/results.json")).unwrap();
    let results: Value = serde_json::from_slice(&results).unwrap();
    let task = &results["tasks"][task];
    let violations = ["ee", "link", "joint_pos", "joint_vel"];
    (
        task["success_rate"].as_f64().unwrap(),
        violations
            .map(|name| task["violations"][name].as_u64().unwrap())
            .iter()
            .sum(),
    )
}

fn made(folder: &Path, args: &[&str]) -> PathBuf {
    let told = succeed(FACEOFF, &[&["new", "my-agent"], args].concat(), folder);
    assert!(told.contains("cd my-agent"), "{told}");
    folder.join("my-agent")
}

#[test]
fn a_python_defender_passes_its_tests_and_stops_pucks() {
    let dir = tempfile::tempdir().unwrap();
    let agent = made(dir.path(), &[]);
    succeed("python3", &["-m", "unittest"], &agent);
    let readme = fs::read_to_string(agent.join("README.md")).unwrap();
    assert!(
        readme.starts_with("# my-agent\n") && !readme.contains("{{"),
        "{readme}"
    );
    let (success_rate, violations) = played(&agent, "defend");
    assert!(success_rate > 0.45, "{success_rate}");
    assert_eq!(violations, 0);
}

#[test]
fn a_python_hitter_passes_its_tests_and_keeps_the_rules() {
    let dir = tempfile::tempdir().unwrap();
    let agent = made(dir.path(), &["--lang", "python", "--example", "hitter"]);
    succeed("python3", &["-m", "unittest"], &agent);
    let (_, violations) = played(&agent, "hit");
    assert_eq!(violations, 0);
}

#[test]
fn the_files_that_are_faceoffs_own_are_the_packages() {
    let dir = tempfile::tempdir().unwrap();
    let agent = made(dir.path(), &[]);
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("../faceoff-py/python/faceoff");
    for (copy, original) in [
        ("protocol.py", "agent.py"),
        ("kinematics.py", "kinematics/plain.py"),
    ] {
        let copied = fs::read(agent.join(copy)).unwrap();
        assert_eq!(copied, fs::read(package.join(original)).unwrap(), "{copy}");
    }
}

/// Builds outside of this workspace, without network, with the versions that this workspace has.
#[test]
fn a_rust_agent_is_built_tested_and_plays() {
    let dir = tempfile::tempdir().unwrap();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (example, task, enough) in [("defender", "defend", 0.45), ("hitter", "hit", 0.0)] {
        let agent = made(dir.path(), &["--lang", "rust", "--example", example]);
        fs::copy(repository.join("Cargo.lock"), agent.join("Cargo.lock")).unwrap();
        // One folder for both: their dependencies are the same.
        let target = dir.path().join("target");
        let cargo = |args: &[&str]| {
            let output = Command::new("cargo")
                .args(args)
                .args(["--offline", "--quiet"])
                .env("CARGO_TARGET_DIR", &target)
                .env("RUSTFLAGS", "-D warnings")
                .current_dir(&agent)
                .output()
                .unwrap();
            assert!(
                output.status.success(),
                "cargo {args:?}: {}",
                text(&output.stderr)
            );
        };
        cargo(&["test"]);
        cargo(&["build"]);
        let bundle = agent.join("bundle");
        fs::copy(target.join("debug/my-agent"), bundle.join("agent")).unwrap();
        let (success_rate, violations) = played(&bundle, task);
        assert!(success_rate >= enough, "{example}: {success_rate}");
        assert_eq!(violations, 0, "{example}");
        fs::remove_dir_all(agent).unwrap();
    }
}

#[test]
fn what_is_there_already_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    let agent = made(dir.path(), &[]);
    fs::write(agent.join("agent.py"), "mine").unwrap();
    let output = run(FACEOFF, &["new", "my-agent"], dir.path());
    assert!(!output.status.success());
    let words = text(&output.stderr);
    assert!(
        words.contains("my-agent is there already; choose another name"),
        "{words}"
    );
    assert_eq!(fs::read_to_string(agent.join("agent.py")).unwrap(), "mine");
}

#[test]
fn a_name_that_a_board_or_a_crate_would_not_take_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["My Agent", "1st", "..", "a/..", "é", &"a".repeat(41)] {
        let output = run(FACEOFF, &["new", name], dir.path());
        assert!(!output.status.success(), "{name}");
        let words = text(&output.stderr);
        assert!(
            words.contains("that begins with a letter, such as my-agent, got"),
            "{words}"
        );
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}
