//! Time budgets against agents that would occupy a slot (the place for a running job) for hours, or that are quick only in short
//! checks. A budget limits the total time of many answers; a time limit holds for one answer.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{python_agent, python_bundle},
    server::Server,
};
use serde_json::Value;

/// A configuration that keeps the time limits of the rules: an agent that sleeps exceeds them on every machine.
const REAL_LIMITS_CONFIG: &str = "[workers]\nslots = 1\n";

fn reason(verdict: &Value) -> &str {
    verdict["reason"].as_str().unwrap_or_default()
}

#[test]
fn agent_slower_than_real_time_is_invalid() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), REAL_LIMITS_CONFIG);
    let team = Team::create(&server, "Slow");
    for (name, on_step, words) in [
        // Each answer takes less than its time limit of 1 s.
        (
            "each-step",
            "time.sleep(0.9); say(hold)",
            &["time budget"][..],
        ),
        // Slower than real time, but within the budget of an episode.
        (
            "slightly-slow",
            "time.sleep(0.025); say(hold)",
            &["too slow", "time budget"],
        ),
        // Quick for the first 60 steps.
        (
            "slow-later",
            "if message['step'] >= 60: time.sleep(0.9)\nsay(hold)",
            &["time budget"],
        ),
        // Quick in all tasks but `prepare`, which begins with the puck at rest. Observations of `prepare` and `defend` have 20
        // numbers; the fourth is the puck's velocity along the table.
        (
            "slow-in-one-task",
            "if message['step'] == 0: is_prepare = len(message['obs']) == 20 and abs(message['obs'][3]) < 0.6\n\
             if is_prepare: time.sleep(0.9)\nsay(hold)",
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
    let team = Team::create(&server, "Slow");
    // The agent computes for 1.2 s when it is reset before an episode: more than the budget of 0.5 s.
    let source = python_agent("say(hold)").replace(
        "held = None\n        say",
        "held = None\n        until = time.process_time() + 1.2\n        while time.process_time() < until: pass\n        say",
    );
    // The platform does not count waiting that another program on the host causes, so the agent uses CPU time. One reset exceeds
    // the budget, since a validation run may have only one episode of each task.
    assert!(source.contains("until"));
    let folder = python_bundle(scratch.path(), "slow-resets", &source);
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
    let verdicts: Vec<Value> = (0..3).map(|_| team.submit(&server, &folder)).collect();
    for verdict in &verdicts {
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
    for (index, verdict) in verdicts.iter().enumerate() {
        let log = verdict["log"].as_str().expect("a valid agent's log");
        let initial_states: Vec<&str> = log.lines().collect();
        assert!(initial_states.len() >= 3, "{log}");
        for other in &verdicts[..index] {
            let other_log = other["log"].as_str().expect("a valid agent's log");
            assert!(
                initial_states
                    .iter()
                    .all(|state| !other_log.contains(state)),
                "{log}\n{other_log}"
            );
        }
    }
}
