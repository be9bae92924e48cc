//! Actions of agents (joint commands for one step) that could break the simulation. Each is either refused as the agent's
//! fault or simulated; none is a fault of the platform, which would give the agent another try.

use crate::{CONFIG, Team, upgrade::verify_dataset};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    server::Server,
};

/// Interpolations (how the joint commands between two steps are computed), each with the shape of its actions. `N` is a number,
/// and `None` is Python's name for JSON's null.
const ACTION_SHAPES: [(&str, &str); 7] = [
    ("1", "[N] * 7"),
    ("2", "[N] * 7"),
    ("3", "[[N] * 7] * 2"),
    ("4", "[[N] * 7] * 2"),
    ("5", "[[N] * 7] * 3"),
    ("-1", "[[N] * 7] * 2"),
    ("None", "[[[N] * 7] * 3] * 20"),
];

/// Refused output lines: name, text, and a part of the verdict's reason. `STEP` stands for the number of the step, `ROW` for a
/// valid row of seven numbers, `DIGITS` for 5000 digits.
const REFUSED_LINES: [(&str, &str, &str); 10] = [
    (
        "out of range",
        r#"{"type":"act","step":STEP,"action":[ROW,[0,0,0,1e999,0,0,0]]}"#,
        "not finite",
    ),
    (
        "minus out of range",
        r#"{"type":"act","step":STEP,"action":[ROW,[0,0,0,0,0,0,-1e309]]}"#,
        "not finite",
    ),
    (
        "thousands of digits",
        r#"{"type":"act","step":STEP,"action":[ROW,[DIGITS,0,0,0,0,0,0]]}"#,
        "not finite",
    ),
    (
        "huge integer",
        r#"{"type":"act","step":STEP,"action":[ROW,[123456789012345678901234567890,0,0,0,0,0,0]]}"#,
        "action[1][0]",
    ),
    (
        "just too large",
        r#"{"type":"act","step":STEP,"action":[ROW,[0,0,10000.001,0,0,0,0]]}"#,
        "action[1][2]",
    ),
    (
        "one too large",
        r#"{"type":"act","step":STEP,"action":[[-1e5,0,0,0,0,0,0],ROW]}"#,
        "action[0][0]",
    ),
    (
        "key twice",
        r#"{"type":"act","step":STEP,"step":STEP,"action":[ROW,ROW]}"#,
        "twice",
    ),
    (
        "unknown key twice",
        r#"{"type":"act","step":STEP,"x":1,"x":2,"action":[ROW,ROW]}"#,
        "twice",
    ),
    (
        "nested key twice",
        r#"{"type":"act","step":STEP,"x":[{"y":{"a":1,"b":2,"a":3}}],"action":[ROW,ROW]}"#,
        "twice",
    ),
    (
        "escaped key twice",
        r#"{"type":"act","step":STEP,"x":{"a":1,"\u0061":2},"action":[ROW,ROW]}"#,
        "twice",
    ),
];

/// The source of an agent with this interpolation and these statements at each step.
fn agent(interpolation: &str, on_step: &str) -> String {
    let last_field = format!("\"interpolation\": {interpolation}}}");
    python_agent(on_step).replace("\"interpolation\": 3}", &last_field)
}

/// Asserts that the validation run of each agent (name, source, part of the reason) finds it invalid for this reason.
fn assert_invalid(agents: &[(String, String, &str)]) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let uploads: Vec<_> = agents
        .iter()
        .enumerate()
        .map(|(number, (name, source, word))| {
            let folder = python_bundle(scratch.path(), &format!("agent-{number}"), source);
            let team = Team::create(&server, &format!("Team {number}"));
            let id = team.upload(&server, pack(&folder));
            (name, word, team, id)
        })
        .collect();
    for (name, word, team, id) in uploads {
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        let reason = verdict["reason"].as_str().expect("a verdict has a reason");
        assert!(reason.contains(word), "{name}: {word:?} is not in {reason}");
    }
}

#[test]
fn largest_numbers_are_refused_in_all_interpolations() {
    let agents: Vec<_> = ACTION_SHAPES
        .into_iter()
        .flat_map(|(interpolation, shape)| {
            ["1.7e308", "-1.7e308"].map(|number| {
                let action = shape.replace('N', number);
                let on_step =
                    format!("say({{'type': 'act', 'step': message['step'], 'action': {action}}})");
                let name = format!("{number} in interpolation {interpolation}");
                (
                    name,
                    agent(interpolation, &on_step),
                    "numbers between -10000 and 10000",
                )
            })
        })
        .collect();
    assert_invalid(&agents);
}

#[test]
fn duplicate_keys_and_non_finite_numbers_are_refused() {
    let agents: Vec<_> = REFUSED_LINES
        .into_iter()
        .map(|(name, line, word)| {
            let on_step = format!(
                "line = {line:?}.replace('STEP', str(message['step']))\n\
                 line = line.replace('ROW', json.dumps(held)).replace('DIGITS', '9' * 5000)\n\
                 sys.stdout.write(line + '\\n'); sys.stdout.flush()"
            );
            (name.to_owned(), python_agent(&on_step), word)
        })
        .collect();
    assert_invalid(&agents);
}

/// A configuration with the one task in which agents make extreme actions.
fn prepare_only() -> String {
    CONFIG.replace("[evaluation]", "[evaluation]\ntasks = [\"prepare\"]")
}

/// Extreme valid actions: name, interpolation, and the action (Python) from the second episode of `prepare` on. The largest
/// valid number is 1e4; `s` is 1e4 and -1e4 alternately, `held` the first measured position. `obs[13:20]` are the joint velocities.
const EXTREME_ACTIONS: [(&str, &str, &str); 7] = [
    (
        "along-its-velocity",
        "None",
        "[[[1e4 if v > 0 else -1e4 for v in message['obs'][13:20]]] * 3] * 20",
    ),
    (
        "all-drives-at-their-limit",
        "None",
        "[[[0.0] * 7, [0.0] * 7, [1e4] * 7]] * 20",
    ),
    (
        "swinging",
        "None",
        "[[[s] * 7, [s] * 7, [s] * 7] for _ in range(20)]",
    ),
    ("accelerations-only", "5", "[held, [0.0] * 7, [s] * 7]"),
    ("velocities-only", "3", "[held, [s] * 7]"),
    ("positions-only", "1", "[s] * 7"),
    ("denormal", "4", "[[5e-324] * 7, [-0.0] * 7]"),
];

#[test]
fn extreme_valid_actions_are_simulated_and_verified() {
    for (name, interpolation, action) in EXTREME_ACTIONS {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let server = Server::start(&scratch.path().join("data"), &prepare_only());
        let team = Team::create(&server, "Alpha");
        // The agent holds still during the validation run, so that it is valid.
        let hold_still = match interpolation {
            "None" => "[[held, [0.0] * 7, [0.0] * 7]] * 20",
            "5" => "[held, [0.0] * 7, [0.0] * 7]",
            "1" => "held",
            _ => "[held, [0.0] * 7]",
        };
        let on_step = format!(
            "s = 1e4 if message['step'] % 2 else -1e4\n\
             hold['action'] = {action} if task == 'prepare' and resets > 1 else {hold_still}\n\
             say(hold)"
        );
        let source = agent(interpolation, &on_step)
            .replace(
                "    if kind == \"hello\":\n",
                "    if kind == \"hello\":\n        task, resets = message[\"task\"], 0\n",
            )
            .replace(
                "    elif kind == \"reset\":\n",
                "    elif kind == \"reset\":\n        resets += 1\n",
            );
        let folder = python_bundle(scratch.path(), name, &source);
        let submission = team.submit(&server, &folder);
        assert_eq!(submission["state"], "valid", "{name}: {submission:#}");
        let evaluation = team.evaluate(&server, &submission);
        let done = team.wait_until_finished(&server, &evaluation);
        assert_eq!(done["state"], "finished", "{name}: {done:#}");
        let timing = &done["result"]["timing"];
        assert!(timing.is_object(), "{name}: {done:#}");
        assert_eq!(
            timing["platform_retries"],
            serde_json::Value::Null,
            "{name}"
        );
        assert_eq!(done["result"]["tasks"]["prepare"]["episodes"], 4, "{name}");
        verify_dataset(&server, &evaluation, &team.token, scratch.path());
    }
}
