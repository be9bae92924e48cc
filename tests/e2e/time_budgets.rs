//! Time budgets against agents that would occupy a slot for hours, or that behave well only in short checks.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{python_agent, python_bundle},
    server::Server,
};
use serde_json::Value;

/// Keeps the time limits of the rules: an agent that sleeps exceeds them on every machine.
const REAL_LIMITS: &str = "[workers]\nslots = 1\n";

fn reason(verdict: &Value) -> &str {
    verdict["reason"].as_str().unwrap_or_default()
}

#[test]
fn agent_slower_than_real_time_is_invalid() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), REAL_LIMITS);
    let team = Team::create(&server, "Slow");
    for (name, on_step, words) in [
        // each answer within its own limit of 1 s
        (
            "each-step",
            "time.sleep(0.9); say(hold)",
            &["time budget"][..],
        ),
        // slow, but within the budget of an episode
        (
            "a-little",
            "time.sleep(0.025); say(hold)",
            &["too slow", "time budget"],
        ),
        // quick for the duration of a short check
        (
            "later",
            "if message['step'] >= 60: time.sleep(0.9)\nsay(hold)",
            &["time budget"],
        ),
        // quick in other tasks: `prepare` starts with the puck at rest
        (
            "one-task",
            "if message['step'] == 0: lazy = len(message['obs']) == 20 and abs(message['obs'][3]) < 0.6\n\
             if lazy: time.sleep(0.9)\nsay(hold)",
            &["prepare", "time budget"],
        ),
    ] {
        let folder = python_bundle(scratch.path(), name, &python_agent(on_step));
        let verdict = team.submit(&server, &folder);
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        assert!(
            words.iter().any(|word| reason(&verdict).contains(word)),
            "{name}: {verdict:#}"
        );
    }
}

#[test]
fn resets_share_a_time_budget() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = "[workers]\nslots = 1\n[time]\nresets_extra_s = 0.5\nreset_mean_s = 0.001\n";
    let server = Server::start(&scratch.path().join("data"), config);
    let team = Team::create(&server, "Dawdler");
    let source = python_agent("say(hold)").replace(
        "held = None\n        say",
        "held = None\n        until = time.process_time() + 1.2\n        while time.process_time() < until: pass\n        say",
    );
    // CPU time of the agent cannot be host interference. One reset is enough, since a validation run may have only one
    // episode of each task.
    assert!(source.contains("until"));
    let folder = python_bundle(scratch.path(), "dawdles", &source);
    let verdict = team.submit(&server, &folder);
    assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    assert!(
        reason(&verdict).contains("time budget: the resets"),
        "{verdict:#}"
    );
}

#[test]
fn validation_runs_differ_per_upload_and_report_answer_times() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Curious");
    // The agent logs the initial states, which could identify a validation run.
    let source = python_agent(
        "if message['step'] == 0: sys.stderr.write(f\"{message['obs'][:3]}\\n\")\nsay(hold)",
    );
    let folder = python_bundle(scratch.path(), "curious", &source);
    let seen: Vec<Value> = (0..3).map(|_| team.submit(&server, &folder)).collect();
    for verdict in &seen {
        assert_eq!(verdict["state"], "valid", "{verdict:#}");
        let timing = verdict["timing"]
            .as_array()
            .expect("a validation run reports times");
        let tasks: Vec<&Value> = timing.iter().map(|timing| &timing["task"]).collect();
        assert_eq!(tasks, ["hit", "defend", "prepare"]);
        for timing in timing {
            assert!(timing["steps"].as_u64() >= Some(250), "{timing:#}");
            assert!(timing["mean_s"].as_f64() > Some(0.0), "{timing:#}");
        }
    }
    for (index, verdict) in seen.iter().enumerate() {
        let log = verdict["log"].as_str().expect("a valid agent's log");
        let starts: Vec<&str> = log.lines().collect();
        assert!(starts.len() >= 3, "{log}");
        for other in &seen[..index] {
            let other = other["log"].as_str().expect("a valid agent's log");
            assert!(
                starts.iter().all(|start| !other.contains(start)),
                "{log}\n{other}"
            );
        }
    }
}
