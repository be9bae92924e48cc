//! `faceoff verify` and `faceoff dataset` on datasets of `faceoff eval`.

use crate::program::{LONG_TIME_LIMITS, SEED, command, faceoff, hold, read_json, text};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};
use tempfile::TempDir;

/// Evaluates the agent `hold` in two episodes per task.
fn eval(out: &Path, extra: &[&str]) {
    let bundle = hold();
    let mut args = vec![
        "eval",
        bundle.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    args.extend(["--config", LONG_TIME_LIMITS]);
    args.extend(["--task", "hit,defend", "--episodes", "2", "--seed", SEED]);
    args.extend(extra);
    let output = command(&args)
        .current_dir(out.parent().unwrap())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
}

/// The folder of a sandboxed evaluation of two tasks.
fn evaluation_folder() -> PathBuf {
    static DIR: OnceLock<TempDir> = OnceLock::new();
    let dir = DIR.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        eval(&dir.path().join("out"), &["--workers", "2"]);
        dir
    });
    dir.path().join("out")
}

/// Standard output of a command that succeeds.
fn stdout(args: &[&str]) -> String {
    let output = faceoff(args);
    assert!(
        output.status.success(),
        "{args:?}: {}",
        text(&output.stderr)
    );
    text(&output.stdout)
}

#[test]
fn evaluation_verifies_with_any_number_of_workers() {
    let out = evaluation_folder();
    let dir = out.to_str().unwrap();
    let line = stdout(&["verify", dir]);
    assert!(line.contains("4 episodes"), "{line}");
    assert!(line.contains("every state and score identical"), "{line}");
    let summary = |workers: &str| -> serde_json::Value {
        let line = stdout(&["verify", dir, "--json", "--workers", workers]);
        let mut summary: serde_json::Value = serde_json::from_str(&line).unwrap();
        for measured in ["seconds", "steps_per_s"] {
            let value = summary.as_object_mut().unwrap().remove(measured).unwrap();
            assert!(value.as_f64().unwrap() > 0.0);
        }
        summary
    };
    assert_eq!(summary("1"), summary("8"));
    assert_eq!(summary("1")["verified"], true);
    let results = read_json(&out.join("results.json"));
    assert_eq!(summary("3")["result"], results);
}

#[test]
fn difference_exits_with_1_and_unreadable_dataset_with_2() {
    let dir = tempfile::tempdir().unwrap();
    let copy = dir.path().join("dataset.zip");
    let good = fs::read(evaluation_folder().join("dataset.zip")).unwrap();
    let verify = |bytes: &[u8], extra: &[&str]| {
        fs::write(&copy, bytes).unwrap();
        let output = faceoff(&[&["verify", copy.to_str().unwrap()], extra].concat());
        (output.status.code().unwrap(), text(&output.stderr))
    };
    assert_eq!(verify(&good, &[]).0, 0);
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 1;
    let (code, message) = verify(&flipped, &[]);
    assert!(
        code == 1 && message.contains("damaged or altered"),
        "{code}: {message}"
    );
    let (code, message) = verify(&good[..good.len() / 2], &[]);
    assert!(
        code == 2 && message.contains("not a readable dataset"),
        "{code}: {message}"
    );
    let (code, message) = verify(
        &good,
        &["--secret", &"00".repeat(32), "--day", "2026-11-21"],
    );
    assert!(
        code == 1 && message.contains("seed does not follow from the season's secret"),
        "{code}: {message}"
    );
    let (code, message) = verify(&good, &["--day", "2026-11-21"]);
    assert!(
        code == 2 && message.contains("--secret"),
        "{code}: {message}"
    );
    let missing = faceoff(&["verify", dir.path().join("none").to_str().unwrap()]);
    assert_eq!(missing.status.code(), Some(2));

    // A results.json that differs from the score in the archive.
    fs::write(&copy, &good).unwrap();
    fs::write(dir.path().join("results.json"), "{}").unwrap();
    let output = faceoff(&["verify", dir.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
}

#[test]
fn episodes_are_listed_and_steps_are_sliced() {
    let out = evaluation_folder();
    let dir = out.to_str().unwrap();
    let list = stdout(&["dataset", "list", dir]);
    assert_eq!(list.lines().count(), 5, "{list}");
    assert!(
        list.lines()
            .nth(1)
            .unwrap()
            .starts_with("hit            0    500 horizon"),
        "{list}"
    );
    let json: Vec<serde_json::Value> = stdout(&["dataset", "list", dir, "--json"])
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(json.len(), 4);
    assert_eq!(
        (&json[3]["task"], &json[3]["episode"]),
        (&"defend".into(), &1.into())
    );

    let slice = |args: &[&str]| {
        let mut all = vec!["dataset", "slice", dir, "--task", "hit", "--episode", "1"];
        all.extend(args);
        stdout(&all)
    };
    let columns = ["--columns", "step,puck_x,action", "--steps", "10..12"];
    let csv = slice(&columns);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!((lines.len(), lines[0]), (3, "step,puck_x,action"));
    assert!(
        lines[1].starts_with("10,") && lines[2].starts_with("11,"),
        "{csv}"
    );
    let jsonl = slice(&[&columns[..], &["--format", "jsonl"]].concat());
    let first: serde_json::Value = serde_json::from_str(jsonl.lines().next().unwrap()).unwrap();
    assert_eq!(first["step"], 10);
    assert_eq!(first["action"].as_array().unwrap().len(), 14);
    assert!(
        lines[1].contains(&format!(",{},\"[", first["puck_x"])),
        "{csv}"
    );
    let file = tempfile::NamedTempFile::new().unwrap();
    slice(&["--out", file.path().to_str().unwrap()]);
    assert_eq!(
        fs::read_to_string(file.path()).unwrap().lines().count(),
        501
    );

    for (args, message) in [
        (
            ["--task", "prepare", "--episode", "0"],
            "no episode of prepare",
        ),
        (["--task", "hit", "--episode", "2"], "there are 2, from 0"),
    ] {
        let output = faceoff(&[&["dataset", "slice", dir][..], &args].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(
            text(&output.stderr).contains(message),
            "{}",
            text(&output.stderr)
        );
    }
    let output = faceoff(&[
        "dataset",
        "slice",
        dir,
        "--task",
        "hit",
        "--episode",
        "0",
        "--columns",
        "speed",
    ]);
    assert!(
        text(&output.stderr).contains("no column \"speed\""),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn export_refers_to_the_python_package() {
    let old = ["dataset", "export", "result/", "--out", "export/"];
    let output = faceoff(&old);
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert!(
        message.contains("python -m faceoff.dataset export DATASET --layout 2023 --out DIR"),
        "{message}"
    );
    assert!(!stdout(&["dataset", "--help"]).contains("export"));
}

#[test]
fn workers_and_shards_only_change_times() {
    let dir = tempfile::tempdir().unwrap();
    // Fields that depend on measured times.
    let measured = ["penalty_points", "computation_time", "fault"];
    let mut runs = Vec::new();
    for workers in ["1", "2", "8"] {
        let out = dir.path().join(workers);
        eval(&out, &["--workers", workers]);
        let list = stdout(&["dataset", "list", out.to_str().unwrap(), "--json"]);
        let episodes: Vec<serde_json::Value> = list
            .lines()
            .map(|line| {
                let mut episode: serde_json::Value = serde_json::from_str(line).unwrap();
                for key in measured {
                    episode.as_object_mut().unwrap().remove(key).unwrap();
                }
                episode
            })
            .collect();
        let columns = "step,obs_puck_x,obs_dq_3,action,puck_x,q_1,dq_7,ee_z,constraint_ee";
        let slice = stdout(&[
            "dataset",
            "slice",
            out.to_str().unwrap(),
            "--task",
            "defend",
            "--episode",
            "1",
            "--columns",
            columns,
        ]);
        runs.push((episodes, slice));
    }
    assert_eq!(runs[0], runs[1]);
    assert_eq!(runs[0], runs[2]);
}

#[test]
fn archive_hash_is_printed_and_compared() {
    let archive = evaluation_folder().join("dataset.zip");
    let hash = blake3::hash(&fs::read(&archive).unwrap()).to_hex();
    let path = archive.to_str().unwrap();
    let line = stdout(&["verify", path, "--blake3", &hash]);
    assert!(line.contains(&*hash), "{line}");
    let other = faceoff(&["verify", path, "--blake3", &"00".repeat(32)]);
    assert_eq!(other.status.code(), Some(1));
    let message = text(&other.stderr);
    assert!(
        message.contains(&*hash) && message.contains("expected 0000"),
        "{message}"
    );

    let dir = tempfile::tempdir().unwrap();
    let file = fs::File::open(&archive).unwrap();
    zip::ZipArchive::new(file)
        .unwrap()
        .extract(dir.path())
        .unwrap();
    let folder = faceoff(&["verify", dir.path().to_str().unwrap(), "--blake3", &hash]);
    assert_eq!(folder.status.code(), Some(2));
    let message = text(&folder.stderr);
    assert!(message.contains("name dataset.zip"), "{message}");
}

#[test]
fn dataset_of_the_previous_layout_is_read() {
    let archive =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/fixtures/dataset-layout-2.zip");
    let archive = archive.to_str().unwrap();
    let line = stdout(&["verify", archive]);
    assert!(line.contains("4 episodes, 548 control steps, every state and score identical"));
    let list = stdout(&["dataset", "list", archive]);
    assert_eq!(list.lines().count(), 5);
    assert!(
        list.contains("hit            1    185 left_table     yes           0"),
        "{list}"
    );
    let slice = stdout(&[
        "dataset",
        "slice",
        archive,
        "--task",
        "hit",
        "--episode",
        "1",
    ]);
    assert_eq!(slice.lines().count(), 186);
    let comparison = stdout(&["compare", archive, archive]);
    assert!(comparison.contains("A: striker") && comparison.contains("statistically tied"));
}
