//! `faceoff play`: games, forfeits, series and refusals.

use crate::program::{LONG_TIME_LIMITS, SEED, command, file_names, hold, read_json, text};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

fn faceoff(args: &[&str], paths: &[&Path]) -> Output {
    command(args).args(paths).output().unwrap()
}

fn play(bundles: [&Path; 2], out: &Path, args: &[&str]) -> Output {
    command(&["play"])
        .args(bundles)
        .args(args)
        .arg("--out")
        .arg(out)
        .args(["--config", LONG_TIME_LIMITS])
        .output()
        .unwrap()
}

#[test]
fn game_has_results_and_a_recording_that_verifies() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let hold = hold();
    let args = ["--steps", "1000", "--seed", SEED];
    let output = play([&hold, &hold], &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(
        table.contains("hold against hold: evaluation (airhockey-2023.3)"),
        "{table}"
    );
    assert!(table.contains("1000 control steps, 2 windows"), "{table}");
    assert_eq!(
        file_names(&out),
        [
            "clips",
            "game.zip",
            "results.json",
            "side-1.zip",
            "side-2.zip"
        ]
    );
    let results = read_json(&out.join("results.json"));
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
    // The rallies, of the folder and of the archive.
    let lists = [out.clone(), out.join("game.zip")].map(|path| {
        let listed = faceoff(&["dataset", "list"], &[&path]);
        assert!(listed.status.success(), "{}", text(&listed.stderr));
        text(&listed.stdout)
    });
    assert_eq!(lists[0], lists[1]);
    let last = lists[0].lines().last().unwrap();
    assert!(
        last.contains("20.00s") && last.contains("game_over"),
        "{last}"
    );
    let json = faceoff(&["dataset", "list", "--json"], &[&out]);
    let rallies: Vec<serde_json::Value> = text(&json.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(rallies.len(), lists[0].lines().count() - 1);
    let steps: u64 = rallies
        .iter()
        .map(|rally| rally["steps"].as_u64().unwrap())
        .sum();
    assert_eq!(steps, 1000);
    assert!(
        rallies
            .iter()
            .all(|rally| rally["score"].as_array().unwrap().len() == 2)
    );
    // Verifies the folder, and the archive with --json.
    for (path, json) in [(out.clone(), false), (out.join("game.zip"), true)] {
        let args: &[&str] = if json {
            &["verify", "--json"]
        } else {
            &["verify"]
        };
        let verified = faceoff(args, &[&path]);
        assert!(verified.status.success(), "{}", text(&verified.stderr));
        let stdout = text(&verified.stdout);
        if json {
            let view: serde_json::Value = serde_json::from_str(&stdout).unwrap();
            assert_eq!(
                (&view["verified"], &view["steps"]),
                (&true.into(), &1000.into())
            );
            assert_eq!(view["result"], results);
        } else {
            assert!(
                stdout.contains("a game of 2 rallies, 1000 control steps"),
                "{stdout}"
            );
        }
    }
    let side = faceoff(&["verify"], &[&out.join("side-1.zip")]);
    assert_eq!(side.status.code(), Some(2));
    assert!(
        text(&side.stderr).contains("one side's archive of a game"),
        "{}",
        text(&side.stderr)
    );

    // A changed results.json, and a changed byte in the archive.
    let results_file = out.join("results.json");
    let altered = text(&fs::read(&results_file).unwrap()).replace("\"goals\": 0", "\"goals\": 9");
    fs::write(&results_file, altered).unwrap();
    let verified = faceoff(&["verify"], &[&out]);
    assert_eq!(verified.status.code(), Some(1));
    assert!(
        text(&verified.stderr).contains("results.json"),
        "{}",
        text(&verified.stderr)
    );
    let archive = out.join("game.zip");
    let mut bytes = fs::read(&archive).unwrap();
    let changed = bytes.len() / 3;
    bytes[changed] ^= 1;
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
fn forfeit_is_a_result_and_json_equals_results_json() {
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
    let stdout = output.stdout;
    assert_eq!(stdout, fs::read(out.join("results.json")).unwrap());
    let results: serde_json::Value = serde_json::from_slice(&stdout).unwrap();
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

/// An agent that reads all of its input before it answers.
fn silent_agent(dir: &Path) -> PathBuf {
    let bundle = dir.join("silent");
    fs::create_dir(&bundle).unwrap();
    let manifest = fs::read_to_string(hold().join("agent.toml")).unwrap();
    let renamed = manifest.replace("\"hold\"", "\"silent\"");
    fs::write(bundle.join("agent.toml"), renamed).unwrap();
    let source = "import sys\nprint('reading', file=sys.stderr)\nanswers = sys.stdin.read()\n";
    fs::write(bundle.join("agent.py"), source).unwrap();
    bundle
}

#[test]
fn silent_side_is_named_and_ends_the_game_or_series() {
    let dir = tempfile::tempdir().unwrap();
    let silent = silent_agent(dir.path());
    let config = dir.path().join("faceoff.toml");
    fs::write(&config, "[time]\nstartup_s = 10.0\n").unwrap();
    for (name, options) in [
        ("game", &["--steps", "1000"][..]),
        ("series", &["--steps", "1000", "--pairs", "3"]),
    ] {
        let out = dir.path().join(name);
        let output = command(&["play"])
            .args([&hold(), &silent])
            .args(options)
            .arg("--out")
            .arg(&out)
            .arg("--config")
            .arg(&config)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1));
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        for expected in [
            "note: side 2 (silent) has not answered `hello` for 5 s",
            "it reads all of its input before it answers",
            "  reading",
        ] {
            assert!(stdout.contains(expected), "{expected:?} is not in {stdout}");
        }
        assert!(!stdout.contains("side 1 (hold)"), "{stdout}");
        let expected =
            "side 2 (silent) never answered, so the game was stopped after its first start: ";
        assert!(stderr.contains(expected), "{stderr}");
        assert!(!stderr.contains("platform fault"), "{stderr}");
        assert!(!out.join("results.json").exists());
    }
}

#[test]
fn invalid_game_is_refused_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let (hold, missing) = (hold(), dir.path().join("missing"));
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
    // The files of an earlier game are removed, so that they are not mistaken for this one's.
    fs::create_dir(&out).unwrap();
    fs::write(out.join("game.zip"), "an earlier game").unwrap();
    refused([&hold, &missing], &[], "there is no bundle at");
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

#[test]
fn mirrored_pairs_share_a_seed_and_swap_sides() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let hold = hold();
    let args = ["--steps", "50", "--pairs", "2", "--seed", SEED, "--json"];
    let output = play([&hold, &hold], &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(output.stdout, fs::read(out.join("results.json")).unwrap());
    let results: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&results["series"], &results["wanted"], &results["draws"]),
        (&"mirrored_pairs".into(), &2.into(), &4.into())
    );
    let mean = &results["goal_difference"];
    assert_eq!((&mean["of"], &mean["mean"]), (&2.into(), &0.0.into()));
    assert!(
        mean["mean_ci95"].is_null(),
        "there is no interval with two pairs"
    );
    let spread = &results["spread"];
    assert_eq!(spread["of_independent_games"], 0.0);
    assert!(spread["ratio"].is_null(), "there is no variance");
    let games = results["games"].as_array().unwrap();
    let column = |key: &str| -> Vec<_> { games.iter().map(|game| game[key].clone()).collect() };
    assert_eq!(column("home"), [0, 1, 0, 1]);
    assert_eq!(column("pair"), [1, 1, 2, 2]);
    let seeds = column("seed");
    assert_eq!((&seeds[0], &seeds[2]), (&seeds[1], &seeds[3]));
    assert_ne!(seeds[0], seeds[2]);
    for game in games {
        let folder = out.join(game["folder"].as_str().unwrap());
        let verified = faceoff(&["verify", "--json"], &[&folder]);
        assert!(verified.status.success(), "{}", text(&verified.stderr));
        let verified: serde_json::Value = serde_json::from_slice(&verified.stdout).unwrap();
        assert_eq!(verified["result"]["seed"], game["seed"]);
    }
    // A second series does not overwrite the recordings of the first.
    let output = play([&hold, &hold], &out, &args);
    assert!(!output.status.success());
    let stderr = text(&output.stderr);
    assert!(stderr.contains("an earlier series"), "{stderr}");
    assert!(out.join("results.json").exists());
}

#[test]
fn series_alternates_sides_and_counts_goals_by_agent() {
    let dir = tempfile::tempdir().unwrap();
    let broken = dir.path().join("broken");
    fs::create_dir(&broken).unwrap();
    let manifest =
        "name = \"broken\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n";
    fs::write(broken.join("agent.toml"), manifest).unwrap();
    fs::write(broken.join("agent.py"), "import torch_of_olympia").unwrap();
    let out = dir.path().join("out");
    let hold = hold();
    // The broken agent has a fault in each rally and forfeits with the eleventh. That takes 7,520 steps, because a rally against an arm
    // that holds still only ends with a foul.
    let args = ["--steps", "9000", "--games", "2", "--profile", "ideal"];
    let output = play([&hold, &broken], &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    assert!(
        stdout.contains("hold won 2 games, drew 0, lost 0"),
        "{stdout}"
    );
    assert!(
        stdout.contains("per game: mean +10.00, variance 0.00"),
        "{stdout}"
    );
    let results = read_json(&out.join("results.json"));
    assert!(results.get("spread").is_none(), "there are no pairs");
    let games = results["games"].as_array().unwrap();
    assert_ne!(games[0]["seed"], games[1]["seed"]);
    for (number, game) in games.iter().enumerate() {
        assert_eq!(game["home"], number);
        assert_eq!(game["score"], serde_json::json!([10, 0]));
        assert_eq!(game["winner"], 0);
        assert_eq!(game["won_by"], "forfeit");
    }
    let refused = play([&hold, &hold], &out, &["--pairs", "1", "--games", "1"]);
    assert!(text(&refused.stderr).contains("cannot be used with"));
}
