//! `faceoff new`: the new agents pass their tests and can be evaluated.

use crate::program::{LONG_TIME_LIMITS, text};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const FACEOFF: &str = env!("CARGO_BIN_EXE_faceoff");

fn run(program: &str, args: &[&str], folder: &Path) -> Output {
    Command::new(program)
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Standard output of a program that succeeds.
fn stdout_of(program: &str, args: &[&str], folder: &Path) -> String {
    let output = run(program, args, folder);
    assert!(
        output.status.success(),
        "{program} {args:?}: {}{}",
        text(&output.stdout),
        text(&output.stderr)
    );
    text(&output.stdout)
}

/// Evaluates some episodes in the evaluation profile; returns success rate and number of constraint violations.
fn evaluate(bundle: &Path, task: &str) -> (f64, u64) {
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
        LONG_TIME_LIMITS,
        "--out",
        "result",
    ];
    stdout_of(FACEOFF, &args, folder);
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

/// Creates the agent `my-agent`; returns its folder.
fn new_agent(folder: &Path, args: &[&str]) -> PathBuf {
    let message = stdout_of(FACEOFF, &[&["new", "my-agent"], args].concat(), folder);
    assert!(message.contains("cd my-agent"), "{message}");
    folder.join("my-agent")
}

#[test]
fn python_defender_passes_its_tests_and_stops_pucks() {
    let dir = tempfile::tempdir().unwrap();
    let agent = new_agent(dir.path(), &[]);
    stdout_of("python3", &["-m", "unittest"], &agent);
    let readme = fs::read_to_string(agent.join("README.md")).unwrap();
    assert!(
        readme.starts_with("# my-agent\n") && !readme.contains("{{"),
        "{readme}"
    );
    let (success_rate, violations) = evaluate(&agent, "defend");
    assert!(success_rate > 0.45, "{success_rate}");
    assert_eq!(violations, 0);
}

#[test]
fn python_hitter_passes_its_tests_and_keeps_the_rules() {
    let dir = tempfile::tempdir().unwrap();
    let agent = new_agent(dir.path(), &["--lang", "python", "--example", "hitter"]);
    stdout_of("python3", &["-m", "unittest"], &agent);
    let (_, violations) = evaluate(&agent, "hit");
    assert_eq!(violations, 0);
}

#[test]
fn library_files_are_copies_of_the_python_package() {
    let dir = tempfile::tempdir().unwrap();
    let agent = new_agent(dir.path(), &[]);
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("../faceoff-py/python/faceoff");
    for (copy, original) in [
        ("protocol.py", "agent.py"),
        ("kinematics.py", "kinematics/plain.py"),
    ] {
        let copied = fs::read(agent.join(copy)).unwrap();
        assert_eq!(copied, fs::read(package.join(original)).unwrap(), "{copy}");
    }
}

/// Builds outside of this workspace, without network and with this workspace's versions of dependencies.
#[test]
fn rust_agents_pass_their_tests_and_are_evaluated() {
    let dir = tempfile::tempdir().unwrap();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (example, task, min_rate) in [("defender", "defend", 0.45), ("hitter", "hit", 0.0)] {
        let agent = new_agent(dir.path(), &["--lang", "rust", "--example", example]);
        fs::copy(repository.join("Cargo.lock"), agent.join("Cargo.lock")).unwrap();
        // Both examples share a target folder, because they have the same dependencies.
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
        let (success_rate, violations) = evaluate(&bundle, task);
        assert!(success_rate >= min_rate, "{example}: {success_rate}");
        assert_eq!(violations, 0, "{example}");
        fs::remove_dir_all(agent).unwrap();
    }
}

#[test]
fn existing_folder_is_not_changed() {
    let dir = tempfile::tempdir().unwrap();
    let agent = new_agent(dir.path(), &[]);
    fs::write(agent.join("agent.py"), "mine").unwrap();
    let output = run(FACEOFF, &["new", "my-agent"], dir.path());
    assert!(!output.status.success());
    let message = text(&output.stderr);
    assert!(
        message.contains("my-agent already exists; choose another name"),
        "{message}"
    );
    assert_eq!(fs::read_to_string(agent.join("agent.py")).unwrap(), "mine");
}

#[test]
fn invalid_agent_name_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["My Agent", "1st", "..", "a/..", "é", &"a".repeat(41)] {
        let output = run(FACEOFF, &["new", name], dir.path());
        assert!(!output.status.success(), "{name}");
        let message = text(&output.stderr);
        assert!(
            message.contains("that begins with a letter, such as my-agent, got"),
            "{message}"
        );
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}
