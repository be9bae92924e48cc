//! `faceoff compare` on datasets of `faceoff eval`.

use crate::program::{LONG_TIME_LIMITS, SEED, agent, faceoff_in, read_json, text};
use serde_json::Value;
use std::{fs, path::Path};

/// Evaluates the example agent `name` in the working folder `folder`; the results are written to its subfolder `out`.
fn eval(folder: &Path, name: &str, out: &str, args: &[&str]) {
    let bundle = agent(name);
    let bundle = bundle.to_str().unwrap();
    let eval = ["eval", bundle, "--out", out, "--config", LONG_TIME_LIMITS];
    let output = faceoff_in(folder, &[&eval, args].concat());
    assert!(output.status.success(), "{out}: {}", text(&output.stderr));
}

#[test]
fn local_evaluations_with_equal_episodes_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Evaluations with equal options and seeds have equal episodes.
    let common = ["--task", "hit,defend", "--episodes", "4"];
    eval(
        folder,
        "hold",
        "a",
        &[&common[..], &["--seed", SEED]].concat(),
    );
    eval(
        folder,
        "reckless",
        "b",
        &[&common[..], &["--seed", SEED]].concat(),
    );
    eval(
        folder,
        "hold",
        "other-seed",
        &[&common[..], &["--seed", "6"]].concat(),
    );
    let shorter = ["--task", "hit,defend", "--episodes", "3", "--seed", SEED];
    eval(folder, "hold", "shorter", &shorter);
    eval(
        folder,
        "hold",
        "ideal",
        &[&common[..], &["--seed", SEED, "--profile", "ideal"]].concat(),
    );

    let output = faceoff_in(folder, &["compare", "a", "b", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let view: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(view["a"]["agent"], "hold");
    assert!(view.get("episodes").is_none());
    let output = faceoff_in(folder, &["compare", "a", "b", "--episodes", "--json"]);
    let listed: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (task, counts) in view["tasks"].as_object().unwrap() {
        let episodes = &listed["episodes"][task];
        let mut all = Vec::new();
        for group in ["both", "only_a", "only_b", "neither"] {
            let list = episodes[group].as_array().unwrap();
            assert_eq!(counts[group], list.len(), "{task}, {group}");
            all.extend(list.iter().map(|episode| episode.as_u64().unwrap()));
        }
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2, 3], "{task}");
    }
    let output = faceoff_in(folder, &["compare", "a", "b", "--episodes"]);
    let table = text(&output.stdout);
    assert!(table.contains("\nepisodes\nhit      only A   "), "{table}");
    let results = |out: &str| -> Value {
        let file = folder.join(out).join("results.json");
        read_json(&file)
    };
    for (side, only_key) in [("a", "only_a"), ("b", "only_b")] {
        let results = results(side);
        assert_eq!(view["overall"][format!("score_{side}")], results["score"]);
        for (task, counts) in view["tasks"].as_object().unwrap() {
            let successes = counts["both"].as_u64().unwrap() + counts[only_key].as_u64().unwrap();
            assert_eq!(
                results["tasks"][task]["successes"], successes,
                "{side} {task}"
            );
        }
    }
    assert_eq!(view["tasks"].as_object().unwrap().len(), 2);

    // The result is the same for folder, archive and unpacked archive.
    let unpacked = folder.join("unpacked");
    let file = fs::File::open(folder.join("a/dataset.zip")).unwrap();
    zip::ZipArchive::new(file)
        .unwrap()
        .extract(&unpacked)
        .unwrap();
    for copy in ["unpacked", "a/dataset.zip"] {
        let output = faceoff_in(folder, &["compare", copy, "b", "--json"]);
        let mut copy_view: Value = serde_json::from_slice(&output.stdout).unwrap();
        copy_view["a"]["path"] = "a".into();
        assert_eq!(copy_view, view, "{copy}");
    }
    let table = faceoff_in(folder, &["compare", "a", "a"]);
    let table = text(&table.stdout);
    for part in [
        "A: hold (a)",
        "statistically tied",
        "95 % interval",
        "score",
    ] {
        assert!(table.contains(part), "{part:?} is not in {table}");
    }

    // Evaluations of different lengths are compared on the episodes that both have.
    let one_task = ["--task", "defend", "--episodes", "6", "--seed", SEED];
    eval(folder, "reckless", "one-task", &one_task);
    for (other, tasks, count, note) in [
        ("shorter", 2, 3, "3 of hit, 3 of defend"),
        ("one-task", 1, 4, "4 of defend"),
    ] {
        let output = faceoff_in(folder, &["compare", "a", other, "--json", "--episodes"]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(
            text(&output.stderr).contains(note),
            "{}",
            text(&output.stderr)
        );
        let shared: Value = serde_json::from_slice(&output.stdout).unwrap();
        let counts = shared["tasks"].as_object().unwrap();
        assert_eq!(counts.len(), tasks);
        for (task, counts) in counts {
            let groups = ["both", "only_a", "only_b", "neither"];
            let all: u64 = groups
                .iter()
                .map(|group| counts[group].as_u64().unwrap())
                .sum();
            assert_eq!(all, count, "{task}");
        }
        // The same as without the other episodes.
        if other == "one-task" {
            assert_eq!(shared["tasks"]["defend"], view["tasks"]["defend"]);
        }
    }

    for (other, field) in [
        ("other-seed", "seed:"),
        (
            "ideal",
            "profile: the first evaluation played evaluation, the second ideal",
        ),
    ] {
        let refused = faceoff_in(folder, &["compare", "a", other]);
        assert!(!refused.status.success(), "{other}");
        let message = text(&refused.stderr);
        assert!(message.contains(field), "{field:?} is not in {message}");
    }

    // A dataset that was changed by hand is refused.
    let episodes = unpacked.join("episodes.parquet");
    let mut bytes = fs::read(&episodes).unwrap();
    bytes[40] ^= 1;
    fs::write(&episodes, bytes).unwrap();
    let refused = faceoff_in(folder, &["compare", "unpacked", "b"]);
    assert!(
        text(&refused.stderr).contains("damaged or altered: episodes.parquet has"),
        "{}",
        text(&refused.stderr)
    );
    let missing = faceoff_in(folder, &["compare", ".", "b"]);
    assert!(
        text(&missing.stderr).contains("holds neither manifest.json nor dataset.zip"),
        "{}",
        text(&missing.stderr)
    );
}
