//! Agents with faults: the verdict of the validation run (the short check of a new submission) gives the reason and shows
//! the agent's log, and other teams are not affected.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    repository,
    server::Server,
};
use serde_json::Value;

/// Faulty agents: name, statements that [`python_agent`] runs at each step, and a part of the verdict's reason.
const FAULTY_AGENTS: [(&str, &str, &str); 6] = [
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
fn faulty_agent_gets_reason_and_log_without_affecting_others() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // 256 MiB: the agent named glutton allocates 1 GiB.
    let config = format!("{CONFIG}\n[limits]\nmemory_bytes = 268435456\n");
    let server = Server::start(&scratch.path().join("data"), &config);

    let good = Team::create(&server, "Good");
    let submission = good.submit(&server, &repository().join("agents/hold"));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = good.evaluate(&server, &submission);

    let verdicts: Vec<(&str, &str, Value)> = FAULTY_AGENTS
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
    assert_eq!(
        good.wait_until_finished(&server, &evaluation)["state"],
        "finished"
    );
}

#[test]
fn silent_agent_is_invalid_and_reason_names_limit() {
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
fn invalid_bundle_reason_names_missing_part() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Careless");

    let without_manifest = scratch.path().join("bare");
    std::fs::create_dir(&without_manifest).expect("a scratch folder can be made");
    std::fs::write(without_manifest.join("agent.py"), "pass").expect("a file can be written");
    let missing_program = python_bundle(scratch.path(), "missing", "pass");
    std::fs::remove_file(missing_program.join("agent.py")).expect("it was just written");
    let mut truncated = pack(&repository().join("agents/hold"));
    truncated.truncate(truncated.len() / 2);

    for (archive, word) in [
        (pack(&without_manifest), "agent.toml"),
        (pack(&missing_program), "agent.py"),
        (truncated, "archive"),
    ] {
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        let reason_and_log = format!("{} {}", verdict["reason"], verdict["log"]);
        assert!(
            reason_and_log.contains(word),
            "{word:?} is not in {reason_and_log}"
        );
    }
}

#[test]
fn agent_failing_midway_fails_evaluation_with_all_faults() {
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
    let team = Team::create(&server, "Half-way");
    // The agent fails only after 15 episodes. A validation run has fewer: it ends with the episode in which it reaches 500
    // steps.
    let source = python_agent(
        "episodes = globals().get('episodes', 0) + (message['step'] == 0)\n\
         if episodes > 15 and message['step'] == 12: sys.stderr.write('enough\\n'); sys.exit(9)\n\
         say(hold)",
    );
    let folder = python_bundle(scratch.path(), "half-way", &source);
    let submission = team.submit(&server, &folder);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);
    let failed = team.wait_until_finished(&server, &evaluation);
    assert_eq!(failed["state"], "agent_failed", "{failed:#}");
    let faults = failed["faults"]
        .as_array()
        .expect("a failed evaluation names its faults");
    assert!(faults.len() > 2, "{failed:#}");
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
        failed["log"]
            .as_str()
            .is_some_and(|log| log.contains("enough")),
        "{failed:#}"
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
