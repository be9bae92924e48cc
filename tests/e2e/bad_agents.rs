//! Agents that break: each gets a verdict with the reason and its log; the others are untouched.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{packed, python_agent, python_bundle},
    repository,
    server::Server,
};
use serde_json::Value;

/// A broken agent: its name, what it does at each step, and a word of the verdict.
const BROKEN: [(&str, &str, &str); 6] = [
    ("rubbish", "print('hello there', flush=True)", "JSON"),
    (
        "endless",
        "sys.stdout.write('x' * 200000); sys.stdout.flush()",
        "65536 bytes",
    ),
    (
        "late-step",
        "say({'type': 'act', 'step': message['step'] + 1, 'action': [held, [0.0] * 7]})",
        "step",
    ),
    (
        "quitter",
        "sys.stderr.write('giving up\\n'); sys.exit(3)",
        "status 3",
    ),
    (
        "not-a-number",
        "hold['action'][0][0] = float('nan'); say(hold)",
        "finite",
    ),
    (
        "glutton",
        "ballast = bytearray(1 << 30); say(hold)",
        "memory",
    ),
];

#[test]
fn a_broken_agent_gets_its_reason_and_its_log_and_harms_nobody() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[limits]\nmemory_bytes = 268435456\n");
    let server = Server::start(&scratch.path().join("data"), &config);

    let good = Team::create(&server, "Good");
    let submission = good.submit(&server, &repository().join("agents/hold"));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = good.evaluate(&server, &submission);

    let verdicts: Vec<(&str, &str, Value)> = BROKEN
        .iter()
        .map(|(name, on_step, word)| {
            let team = Team::create(&server, name);
            let source = python_agent(&format!("sys.stderr.write('{name} speaks\\n')\n{on_step}"));
            let folder = python_bundle(scratch.path(), name, &source);
            (*name, *word, team.submit(&server, &folder))
        })
        .collect();
    for (name, word, verdict) in verdicts {
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        let reason = verdict["reason"]
            .as_str()
            .expect("an invalid agent has a reason");
        assert!(
            reason.contains(word),
            "{name}: {word:?} is not in {reason:?}"
        );
        let log = verdict["log"].as_str().expect("an invalid agent has a log");
        assert!(log.contains(&format!("{name} speaks")), "{name}: {log:?}");
    }
    assert_eq!(good.finished(&server, &evaluation)["state"], "finished");
}

#[test]
fn an_agent_that_never_answers_is_told_the_limit() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = CONFIG.replace("step_s = 600.0", "step_s = 0.5");
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Silent");
    let folder = python_bundle(scratch.path(), "silent", &python_agent("continue"));
    let verdict = team.submit(&server, &folder);
    assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    let reason = verdict["reason"]
        .as_str()
        .expect("an invalid agent has a reason");
    assert!(reason.contains("0.5 s"), "{reason:?}");
}

#[test]
fn a_bundle_that_is_no_bundle_names_what_is_missing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Careless");

    let without_manifest = scratch.path().join("bare");
    std::fs::create_dir(&without_manifest).expect("a scratch folder can be made");
    std::fs::write(without_manifest.join("agent.py"), "pass").expect("a file can be written");
    let missing_program = python_bundle(scratch.path(), "missing", "pass");
    std::fs::remove_file(missing_program.join("agent.py")).expect("it was just written");
    let mut truncated = packed(&repository().join("agents/hold"));
    truncated.truncate(truncated.len() / 2);

    for (archive, word) in [
        (packed(&without_manifest), "agent.toml"),
        (packed(&missing_program), "agent.py"),
        (truncated, "archive"),
    ] {
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        let said = format!("{} {}", verdict["reason"], verdict["log"]);
        assert!(said.contains(word), "{word:?} is not in {said}");
    }
}

#[test]
fn an_agent_that_breaks_half_way_fails_its_evaluation_with_every_fault_named() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = CONFIG
        .replace(
            "episodes_per_task = 4",
            "episodes_per_task = 60\ntasks = [\"defend\"]",
        )
        .replace(
            "episodes_per_shard = 2",
            "episodes_per_shard = 60\nmax_faults = 2",
        );
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Half way");
    // Good for more episodes than a smoke run, of at most 500 control steps and the rest of an episode, holds.
    let source = python_agent(
        "begun = globals().get('begun', 0) + (message['step'] == 0)\n\
         if begun > 15 and message['step'] == 12: sys.stderr.write('enough\\n'); sys.exit(9)\n\
         say(hold)",
    );
    let folder = python_bundle(scratch.path(), "half-way", &source);
    let submission = team.submit(&server, &folder);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);
    let done = team.finished(&server, &evaluation);
    assert_eq!(done["state"], "agent_failed", "{done:#}");
    let faults = done["faults"]
        .as_array()
        .expect("a failed evaluation names its faults");
    assert!(faults.len() > 2, "{done:#}");
    for fault in faults {
        assert_eq!(fault["step"], 12);
        assert!(
            fault["message"]
                .as_str()
                .is_some_and(|text| text.contains("status 9")),
            "{fault:#}"
        );
    }
    assert!(
        done["log"]
            .as_str()
            .is_some_and(|log| log.contains("enough")),
        "{done:#}"
    );
    let board: Value = server
        .get("/api/v1/board", None)
        .json()
        .expect("the API speaks JSON");
    assert_eq!(
        board["rows"].as_array().map(Vec::len),
        Some(0),
        "no score is published"
    );
}
