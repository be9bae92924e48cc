use crate::PATIENT;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn hold() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../agents/hold")
}

fn faceoff(args: &[&str], paths: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_faceoff"))
        .args(args)
        .args(paths)
        .output()
        .unwrap()
}

fn play(bundles: [&Path; 2], out: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_faceoff"))
        .arg("play")
        .args(bundles)
        .args(args)
        .arg("--out")
        .arg(out)
        .args(["--config", PATIENT])
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_game_leaves_results_and_a_recording_that_verifies() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let hold = hold();
    let args = ["--steps", "1000", "--seed", "5"];
    let output = play([&hold, &hold], &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(
        table.contains("hold against hold: evaluation (airhockey-2023.2)"),
        "{table}"
    );
    assert!(table.contains("1000 control steps, 2 windows"), "{table}");
    let mut left: Vec<_> = out
        .read_dir()
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    left.sort();
    assert_eq!(
        left,
        ["game.zip", "results.json", "side-1.zip", "side-2.zip"]
    );
    let results: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("results.json")).unwrap()).unwrap();
    for key in ["ruleset", "profile", "seed", "steps", "sides", "end"] {
        assert!(results.get(key).is_some(), "{key}");
    }
    assert!(results.as_object().unwrap().contains_key("winner"));
    assert_eq!(
        (&results["steps"], &results["end"]),
        (&1000.into(), &"played".into())
    );
    for side in results["sides"].as_array().unwrap() {
        assert_eq!(
            (&side["agent"], &side["goals"]),
            (&"hold".into(), &0.into())
        );
        for key in [
            "fouls",
            "score",
            "penalty_points",
            "violations",
            "tier",
            "faults",
            "computation_time_s",
        ] {
            assert!(side.get(key).is_some(), "{key}");
        }
    }
    // The folder, the archive, and with --json.
    for (path, json) in [(out.clone(), false), (out.join("game.zip"), true)] {
        let args: &[&str] = if json {
            &["verify", "--json"]
        } else {
            &["verify"]
        };
        let verified = faceoff(args, &[&path]);
        assert!(verified.status.success(), "{}", text(&verified.stderr));
        let said = text(&verified.stdout);
        if json {
            let said: serde_json::Value = serde_json::from_str(&said).unwrap();
            assert_eq!(
                (&said["verified"], &said["steps"]),
                (&true.into(), &1000.into())
            );
            assert_eq!(said["result"], results);
        } else {
            assert!(
                said.contains("a game of 2 rallies, 1000 control steps"),
                "{said}"
            );
        }
    }
    let side = faceoff(&["verify"], &[&out.join("side-1.zip")]);
    assert_eq!(side.status.code(), Some(2));
    assert!(
        text(&side.stderr).contains("one side's own file"),
        "{}",
        text(&side.stderr)
    );

    // A score that was changed beside the archive, and a byte that was changed inside.
    let beside = out.join("results.json");
    let altered = text(&fs::read(&beside).unwrap()).replace("\"goals\": 0", "\"goals\": 9");
    fs::write(&beside, altered).unwrap();
    let verified = faceoff(&["verify"], &[&out]);
    assert_eq!(verified.status.code(), Some(1));
    assert!(
        text(&verified.stderr).contains("results.json"),
        "{}",
        text(&verified.stderr)
    );
    let archive = out.join("game.zip");
    let mut bytes = fs::read(&archive).unwrap();
    let middle = bytes.len() / 3;
    bytes[middle] ^= 1;
    fs::write(&archive, bytes).unwrap();
    let verified = faceoff(&["verify"], &[&archive]);
    assert_eq!(verified.status.code(), Some(1));
    assert!(
        text(&verified.stderr).contains("damaged or altered"),
        "{}",
        text(&verified.stderr)
    );
}

#[test]
fn json_is_what_results_json_is_and_a_forfeit_is_a_result() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("broken");
    fs::create_dir(&bundle).unwrap();
    fs::write(
        bundle.join("agent.toml"),
        "name = \"broken\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n",
    )
    .unwrap();
    fs::write(bundle.join("agent.py"), "import torch_of_olympia").unwrap();
    let out = dir.path().join("out");
    let args = ["--steps", "45000", "--profile", "ideal", "--json"];
    let output = play([&bundle, &bundle], &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = output.stdout;
    assert_eq!(said, fs::read(out.join("results.json")).unwrap());
    let results: serde_json::Value = serde_json::from_slice(&said).unwrap();
    assert_eq!(results["end"], "both_forfeit");
    assert_eq!(results["drawn_by"], "both_forfeit");
    assert_eq!(results["winner"], serde_json::Value::Null);
    for side in results["sides"].as_array().unwrap() {
        assert_eq!((&side["faults"], &side["score"]), (&11.into(), &0.into()));
        assert_eq!(side["forfeit"]["kind"], "faults");
    }
    let verified = faceoff(&["verify"], &[&out]);
    assert!(verified.status.success(), "{}", text(&verified.stderr));
}

#[test]
fn what_cannot_be_played_is_refused_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let (hold, nothing) = (hold(), dir.path().join("nothing"));
    let refused = |bundles: [&Path; 2], args: &[&str], reason: &str| {
        let output = play(bundles, &out, args);
        assert!(!output.status.success());
        let stderr = text(&output.stderr);
        assert!(stderr.contains(reason), "{stderr:?} lacks {reason:?}");
        assert!(!out.join("results.json").exists());
    };
    let evaluated = dir.path().join("evaluated");
    fs::create_dir(&evaluated).unwrap();
    fs::write(evaluated.join("dataset.zip"), "an evaluation").unwrap();
    fs::write(evaluated.join("results.json"), "{}").unwrap();
    let output = play([&hold, &hold], &evaluated, &[]);
    assert!(!output.status.success());
    assert!(text(&output.stderr).contains("results of an evaluation"));
    assert!(evaluated.join("results.json").exists());
    // Of an earlier game nothing is left that could be taken for this one's.
    fs::create_dir(&out).unwrap();
    fs::write(out.join("game.zip"), "an earlier game").unwrap();
    refused([&hold, &nothing], &[], "there is no bundle at");
    assert!(!out.join("game.zip").exists());
    refused([dir.path(), &hold], &[], "there is no agent.toml");
    refused([&hold, &hold], &["--steps", "0"], "0 is not in 1..=450000");
    refused(
        [&hold, &hold],
        &["--profile", "easy"],
        "unknown profile \"easy\"",
    );
    refused([&hold, &hold], &["--seed", "lucky"], "not a seed");
}
