//! `faceoff eval`: results, faults, ablations and refusals.

use crate::program::{LONG_TIME_LIMITS, SEED, command, file_names, hold, read_json, text};
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

const MANIFEST: &str =
    "name = \"test\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n";

fn eval(bundle: &Path, out: &Path, args: &[&str]) -> Output {
    command(&["eval"])
        .arg(bundle)
        .args(args)
        .arg("--out")
        .arg(out)
        .args(["--config", LONG_TIME_LIMITS])
        // A configuration in the working folder must not have an effect.
        .current_dir(out.parent().unwrap())
        .output()
        .unwrap()
}

/// `results.json` without values that depend on measured times.
fn result(out: &Path) -> serde_json::Value {
    let mut result = read_json(&out.join("results.json"));
    for key in ["penalty_points", "tier", "timing"] {
        result.as_object_mut().unwrap().remove(key).unwrap();
    }
    for task in result["tasks"].as_object_mut().unwrap().values_mut() {
        for key in ["computation_time_s", "penalty_points", "tier"] {
            task.as_object_mut().unwrap().remove(key).unwrap();
        }
        task["violations"]["computation_time"] = 0.into();
    }
    result
}

#[test]
fn result_does_not_depend_on_workers_sandbox_or_packing() {
    let dir = tempfile::tempdir().unwrap();
    let archive = dir.path().join("hold.tar.gz");
    let packed = Command::new("tar")
        .arg("-czf")
        .arg(&archive)
        .arg("-C")
        .arg(hold().parent().unwrap())
        .arg("hold")
        .status()
        .unwrap();
    assert!(packed.success());
    let common = ["--task", "hit,defend", "--episodes", "3", "--seed", SEED];
    let mut results = Vec::new();
    for (name, bundle, extra) in [
        ("folder", hold(), &[][..]),
        ("archive", archive, &["--workers", "3"]),
        ("bare", hold(), &["--no-sandbox", "--workers", "2"]),
    ] {
        let out = dir.path().join(name);
        let output = eval(&bundle, &out, &[&common[..], extra].concat());
        assert!(output.status.success(), "{name}: {}", text(&output.stderr));
        let table = text(&output.stdout);
        assert!(
            table.contains("hold: evaluation (airhockey-2023.3)"),
            "{table}"
        );
        assert!(table.contains("\ndefend          3 "), "{table}");
        results.push(result(&out));
        assert_eq!(file_names(&out), ["dataset.zip", "results.json"]);
    }
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
    assert_eq!(results[0]["tasks"]["hit"]["episodes"], 3);
}

#[test]
fn failed_agent_is_reported_with_fault_and_log() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    fs::write(bundle.join("agent.toml"), MANIFEST).unwrap();
    fs::write(bundle.join("agent.py"), "import torch_of_olympia").unwrap();
    let out = dir.path().join("out");
    // The score of an earlier run must not be mistaken for this one's.
    let first = eval(&hold(), &out, &["--task", "defend", "--episodes", "1"]);
    assert!(first.status.success(), "{}", text(&first.stderr));

    let output = eval(&bundle, &out, &["--episodes", "8", "--workers", "2"]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = text(&output.stderr);
    assert!(
        stderr.contains("the agent failed: it had more than 10 faults"),
        "{stderr}"
    );
    assert!(
        stderr.contains("start-up: the agent exited with status 1"),
        "{stderr}"
    );
    let stdout = text(&output.stdout);
    assert!(
        stdout.contains("No module named 'torch_of_olympia'"),
        "{stdout}"
    );
    let log = fs::read_to_string(out.join("agent.log")).unwrap();
    assert!(log.contains("No module named 'torch_of_olympia'"), "{log}");
    assert!(!out.join("results.json").exists() && !out.join("dataset.zip").exists());
}

#[test]
fn silent_agent_is_stopped_after_its_first_start() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    fs::copy(hold().join("agent.toml"), bundle.join("agent.toml")).unwrap();
    let source = "import sys\nprint('reading', file=sys.stderr)\nanswers = sys.stdin.read()\n";
    fs::write(bundle.join("agent.py"), source).unwrap();
    fs::write(
        dir.path().join("faceoff.toml"),
        "[time]\nstartup_s = 10.0\n",
    )
    .unwrap();
    let output = command(&[
        "eval",
        "bundle",
        "--episodes",
        "100",
        "--config",
        "faceoff.toml",
    ])
    .current_dir(dir.path())
    .output()
    .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(stdout.matches("fault: ").count(), 1, "{stdout}");
    for expected in [
        "note: the agent has not answered `hello` for 5 s",
        "it reads all of its input before it answers",
        "  reading",
    ] {
        assert!(stdout.contains(expected), "{expected:?} is not in {stdout}");
    }
    assert!(
        stderr.contains(
            "the agent never answered, so the evaluation was stopped after its first start"
        ),
        "{stderr}"
    );
}

/// The agent answers `hello` at once. Its first reset takes longer than the time without an answer after which the likely causes
/// are printed.
#[test]
fn slow_first_reset_prints_no_silence_note() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    for name in ["agent.toml", "agent.py", "protocol.py"] {
        fs::copy(hold().join(name), bundle.join(name)).unwrap();
    }
    let source = fs::read_to_string(bundle.join("agent.py")).unwrap();
    let slow = source.replace(
        "        self.pose = None\n\n",
        "        self.pose = None\n        __import__('time').sleep(6)\n\n",
    );
    assert_ne!(slow, source);
    fs::write(bundle.join("agent.py"), slow).unwrap();
    let args = ["--task", "defend", "--episodes", "1"];
    let output = eval(&bundle, &dir.path().join("out"), &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    assert!(!stdout.contains("has not answered"), "{stdout}");
}

#[test]
fn several_seeds_are_evaluated_and_pooled() {
    let dir = tempfile::tempdir().unwrap();
    let common = ["--task", "hit,defend", "--episodes", "3"];
    let out = dir.path().join("out");
    let output = eval(
        &hold(),
        &out,
        &[&common[..], &["--seed", "1,2", "--json"]].concat(),
    );
    assert!(output.status.success(), "{}", text(&output.stderr));
    let view: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut successes = [0, 0];
    for (run, seed) in view["runs"].as_array().unwrap().iter().zip(["1", "2"]) {
        assert_eq!(run["seed"], seed);
        // The same as with this seed alone.
        let alone = dir.path().join(format!("alone-{seed}"));
        let output = eval(&hold(), &alone, &[&common[..], &["--seed", seed]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(result(&out.join(format!("seed-{seed}"))), result(&alone));
        for (task, all) in ["hit", "defend"].iter().zip(&mut successes) {
            *all += run["result"]["tasks"][task]["successes"].as_u64().unwrap();
        }
    }
    for (task, successes) in ["hit", "defend"].iter().zip(successes) {
        let pooled = &view["together"][task];
        assert_eq!(
            (&pooled["episodes"], &pooled["successes"]),
            (&6.into(), &successes.into())
        );
    }
    let refused = eval(&hold(), &out, &["--seed", "1,2", "--ablation"]);
    assert!(text(&refused.stderr).contains("--ablation takes one seed"));
}

#[test]
fn missing_runtime_is_reported_once_with_its_fix() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    for file in ["agent.py", "protocol.py"] {
        fs::copy(hold().join(file), bundle.join(file)).unwrap();
    }
    let refused = |runtime: &str, words: &[&str]| {
        let manifest = MANIFEST.replace("\"python3\"\n", &format!("\"{runtime}\"\n"));
        fs::write(bundle.join("agent.toml"), manifest).unwrap();
        let output = command(&["eval", "bundle", "--episodes", "2"])
            .current_dir(dir.path())
            .env("XDG_DATA_HOME", dir.path().join("share"))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1));
        let error = text(&output.stderr);
        for word in words {
            assert!(error.contains(word), "{word:?} is not in {error}");
        }
        assert!(!text(&output.stdout).contains("fault"));
    };
    let folder = dir.path().join("share/faceoff/python3-ml");
    let command = format!("docker/runtime.sh {}", folder.display());
    // Unless this machine has the runtime in the folder where organisers put it.
    if !Path::new("/srv/faceoff/python3-ml").exists() {
        refused("python3-ml", &[&command]);
    }
    refused(
        "matlab",
        &["\"matlab\"", "native, python3", "[runtimes.matlab]"],
    );
    // Agents cannot see a folder below /tmp, and it is found there.
    fs::create_dir_all(folder.join("bin")).unwrap();
    fs::write(folder.join("bin/python3"), "").unwrap();
    refused("python3-ml", &["runtimes.python3-ml", "outside of /tmp"]);
}

#[test]
fn fault_with_a_result_has_traceback_and_status_1() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = dir.path().join("bundle");
    fs::create_dir(&bundle).unwrap();
    for file in ["agent.toml", "protocol.py"] {
        fs::copy(hold().join(file), bundle.join(file)).unwrap();
    }
    let source = fs::read_to_string(hold().join("agent.py")).unwrap();
    let broken = "        if self.task == 'defend':\n            print('\\x1b[31mlooking')\n            1 / 0\n        \
                  if self.pose is None";
    let source = source.replace("        if self.pose is None", broken);
    fs::write(bundle.join("agent.py"), source).unwrap();
    let out = dir.path().join("out");
    let args = ["--task", "hit,defend", "--episodes", "2"];
    let output = eval(&bundle, &out, &args);
    assert_eq!(output.status.code(), Some(1));
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    for expected in [
        "fault: defend, episode 0, step 0",
        "the agent's output before its first fault:\n  looking\n  Traceback (most recent call last):",
        "  ZeroDivisionError: division by zero",
        "penalty points",
    ] {
        assert!(stdout.contains(expected), "{expected:?} is not in {stdout}");
    }
    // Equal faults are printed once, as they happen, and counted at the end.
    assert_eq!(stdout.matches("fault: defend").count(), 1, "{stdout}");
    assert!(stdout.contains("2 episodes had this fault"), "{stdout}");
    assert!(stderr.contains("the agent had 2 faults"), "{stderr}");
    assert!(out.join("results.json").exists() && out.join("dataset.zip").exists());
    let log = fs::read_to_string(out.join("agent.log")).unwrap();
    assert_eq!(log.matches("Traceback").count(), 2, "{log}");

    let allowed = eval(
        &bundle,
        &out,
        &[&args[..], &["--allow-faults", "--json"]].concat(),
    );
    assert!(allowed.status.success(), "{}", text(&allowed.stderr));
    let view: serde_json::Value = serde_json::from_slice(&allowed.stdout).unwrap();
    assert_eq!(view["faults"].as_array().unwrap().len(), 2, "{view:#}");
    assert_eq!(view["result"]["tasks"]["defend"]["episodes"], 2);
    assert!(text(&allowed.stderr).contains("ZeroDivisionError"));
}

#[test]
fn bundle_can_be_evaluated_repeatedly_in_its_own_folder() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["agent.toml", "agent.py", "protocol.py"] {
        fs::copy(hold().join(file), dir.path().join(file)).unwrap();
    }
    let run_in_folder = |args: &[&str]| {
        let output = command(args).current_dir(dir.path()).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let eval = [
        "eval",
        ".",
        "--task",
        "defend",
        "--episodes",
        "1",
        "--config",
        LONG_TIME_LIMITS,
    ];
    for out in [
        &["--out", "faceoff-eval"][..],
        &["--out", "results/a"],
        &["--out", "results/a"],
    ] {
        run_in_folder(&[&eval[..], out].concat());
    }
    let packed = run_in_folder(&["submit", ".", "--dry-run", "--json"]);
    let packed: serde_json::Value = serde_json::from_str(&packed).unwrap();
    // Of the files that `submit` does not pack, the answer lists those that a rule leaves out: here the default folder of `eval`.
    assert_eq!(packed["left_out"], serde_json::json!(["faceoff-eval"]));
}

#[test]
fn invalid_evaluation_is_refused_with_a_reason() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let refused = |bundle: &Path, args: &[&str], reason: &str| {
        let output = eval(bundle, &out, args);
        assert!(!output.status.success());
        let stderr = text(&output.stderr);
        assert!(stderr.contains(reason), "{stderr:?} lacks {reason:?}");
    };
    refused(&dir.path().join("nothing"), &[], "there is no bundle at");
    refused(dir.path(), &[], "there is no agent.toml");
    refused(&hold(), &["--task", "juggle"], "unknown task \"juggle\"");
    refused(&hold(), &["--episodes", "0"], "0 is not in 1..=100000");
    refused(&hold(), &["--profile", "easy"], "unknown profile \"easy\"");
    refused(&hold(), &["--seed", "lucky"], "not a seed");
    fs::write(
        dir.path().join("agent.toml"),
        MANIFEST.replace("python3\"\n", "fortran\"\n"),
    )
    .unwrap();
    fs::create_dir(dir.path().join("b")).unwrap();
    fs::rename(
        dir.path().join("agent.toml"),
        dir.path().join("b/agent.toml"),
    )
    .unwrap();
    refused(
        &dir.path().join("b"),
        &["--episodes", "20"],
        "the runtime \"fortran\", which this machine does not have",
    );
}

#[test]
fn ablation_compares_the_profiles_on_the_same_episodes() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let args = [
        "--ablation",
        "--task",
        "prepare",
        "--episodes",
        "2",
        "--seed",
        SEED,
    ];
    let output = eval(&hold(), &out, &args);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    let profiles = [
        "ideal",
        "model_mismatch",
        "observation_noise",
        "disturbance",
        "tracking_loss",
        "evaluation",
    ];
    let file = read_json(&out.join("ablation.json"));
    let rows = file["tasks"]["prepare"].as_array().unwrap();
    assert_eq!(rows.len(), profiles.len());
    for (row, profile) in rows.iter().zip(profiles) {
        assert!(table.contains(&format!("\nprepare  {profile} ")), "{table}");
        assert_eq!(row["profile"], profile);
        let result = result(&out.join(profile));
        assert_eq!(result["profile"], profile);
        assert_eq!(result["seed"], file["seed"]);
        assert_eq!(result["tasks"]["prepare"]["successes"], row["successes"]);
        assert_eq!(
            result["tasks"]["prepare"]["success_ci95"],
            row["success_ci95"]
        );
        assert!(out.join(profile).join("dataset.zip").exists());
    }
    // An evaluation in one profile gives the same result as the ablation.
    let single = dir.path().join("single");
    let args = [
        "--profile",
        "tracking_loss",
        "--task",
        "prepare",
        "--episodes",
        "2",
        "--seed",
        SEED,
    ];
    assert!(eval(&hold(), &single, &args).status.success());
    assert_eq!(result(&single), result(&out.join("tracking_loss")));
}

#[test]
fn rules_of_a_configuration_apply_and_verify() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("rules.toml");
    let long_time_limits = fs::read_to_string(LONG_TIME_LIMITS).unwrap();
    let rules = "[evaluation]\nweights = { hit = 1, defend = 0, prepare = 0 }\n\
                 tier_bounds = { deployable = 20, improvable = 30 }\n\
                 perturbations = { observation_noise = { puck_position_m = 0.05 } }\n";
    fs::write(&config, format!("{long_time_limits}\n{rules}")).unwrap();
    let run = |out: &Path| {
        command(&["eval"])
            .arg(hold())
            .args([
                "--task",
                "hit",
                "--episodes",
                "2",
                "--seed",
                SEED,
                "--no-sandbox",
                "--config",
            ])
            .arg(&config)
            .arg("--out")
            .arg(out)
            .output()
            .unwrap()
    };
    let out = dir.path().join("out");
    let output = run(&out);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let result = read_json(&out.join("results.json"));
    assert_eq!(result["weights"]["hit"], 1.0);
    assert_eq!(result["tier"], "deployable");
    assert_eq!(
        result["perturbations"]["observation_noise"]["puck_position_m"],
        0.05
    );
    let verified = command(&["verify"])
        .arg(out.join("dataset.zip"))
        .output()
        .unwrap();
    assert!(verified.status.success(), "{}", text(&verified.stderr));

    let impossible =
        "[evaluation]\nperturbations = { model_mismatch = { static_error_m = [0.9, 1.0] } }\n";
    fs::write(&config, format!("{long_time_limits}\n{impossible}")).unwrap();
    let output = run(&out);
    let error = text(&output.stderr);
    assert!(
        !output.status.success() && error.contains("static_error_m"),
        "{error}"
    );
}
