//! Teams share slots, whatever their agents do: judged by the order in which a real server with one slot
//! begins its units, as its log tells.

use crate::{Team, path_of, start_day};
use faceoff_tests::{
    bundle::{packed, python_agent, python_bundle},
    server::Server,
};
use serde_json::{Value, json};
use std::{collections::BTreeMap, path::Path};

/// One slot, small shards, and limits that a sleeper meets.
const CONFIG: &str = concat!(
    include_str!("../patient.toml"),
    r#"
[evaluation]
tasks = ["prepare"]
episodes_per_task = 12
episodes_per_shard = 1
[workers]
slots = 1
"#
);

/// A configuration in which who does not start is waited for so long.
fn with_startup_s(seconds: f64) -> String {
    let changed = [
        ("startup_s = 600.0", format!("startup_s = {seconds:.1}")),
        // Enough to be in its middle for a while.
        (
            "episodes_per_task = 12",
            "episodes_per_task = 40".to_owned(),
        ),
    ];
    changed
        .iter()
        .fold(CONFIG.to_owned(), |config, (from, to)| {
            assert!(config.contains(from), "{from}");
            config.replace(from, to)
        })
}

/// A unit that the slot worked on, as the log tells.
#[derive(Debug, Clone, PartialEq)]
struct Worked {
    /// What it is: `smoke` of a submission, `shard` of an evaluation or ablation, `finalise`.
    kind: &'static str,
    /// Of what: an id.
    of: String,
    /// Milliseconds.
    from: i64,
    to: i64,
}

impl Worked {
    fn took(&self) -> i64 {
        self.to - self.from
    }
}

/// Milliseconds within the day of a line's time stamp, `2026-03-01T10:00:00.123456Z`.
fn stamp(line: &str) -> i64 {
    let time = line.split_once('T').expect("a time stamp").1;
    let number = |range: std::ops::Range<usize>| -> i64 { time[range].parse().expect("digits") };
    ((number(0..2) * 60 + number(3..5)) * 60 + number(6..8)) * 1000 + number(9..12)
}

/// All units that were begun, in order.
fn worked(server: &Server) -> Vec<Worked> {
    let mut begun: Vec<(String, Worked)> = Vec::new();
    for line in server.log().lines() {
        let Some((_, rest)) = line.split_once("faceoff_worker::slot: ") else {
            continue;
        };
        let field = |name: &str| rest.split_once(name).map(|(_, rest)| rest.to_owned());
        let unit = field("unit=").expect("a unit")[..36].to_owned();
        if rest.starts_with("begun") {
            let work = field("work=").expect("what it is");
            let (kind, before) = if work.starts_with("smoke run") {
                ("smoke", "submission ")
            } else if work.starts_with("finalisation") {
                ("finalise", "evaluation ")
            } else {
                ("shard", " of ")
            };
            let of = work.split_once(before).expect("of what").1[..36].to_owned();
            // The slot has ended each before it began the next; of the last one nothing is asked.
            let (from, to) = (stamp(line), stamp(line));
            begun.push((unit, Worked { kind, of, from, to }));
        } else {
            let of_unit = begun.iter_mut().rfind(|one| one.0 == unit);
            of_unit.expect("it was begun before").1.to = stamp(line);
        }
    }
    begun.into_iter().map(|one| one.1).collect()
}

/// As long as work of both sorts waits, neither has two units in a row but while the other is ahead by slot
/// time: by no more than its longest unit, however slow the machine is.
fn check_turns(order: &[Worked], one: impl Fn(&Worked) -> bool, other: impl Fn(&Worked) -> bool) {
    for (sort, opposite) in [
        (
            &one as &dyn Fn(&Worked) -> bool,
            &other as &dyn Fn(&Worked) -> bool,
        ),
        (&other, &one),
    ] {
        let both: Vec<&Worked> = order
            .iter()
            .filter(|unit| one(unit) || other(unit))
            .collect();
        // Before its first and after its last one nothing of the other sort waits.
        let opposites = || both.iter().enumerate().filter(|(_, unit)| opposite(unit));
        let first = opposites().next().expect("there are some").0;
        let last = opposites().next_back().expect("there are some").0;
        let longest = opposites().map(|(_, unit)| unit.took()).max();
        // What passes between a claim and its line in the log is in neither.
        let longest = longest.unwrap_or_default() + 2000;
        for run in both[first..last].chunk_by(|a, b| sort(a) == sort(b)) {
            if sort(run[0]) {
                // The last of them was begun while the sort was not ahead.
                let before_the_last: i64 =
                    run[..run.len() - 1].iter().map(|unit| unit.took()).sum();
                assert!(before_the_last <= longest, "{run:#?}\nof {order:#?}");
            }
        }
    }
}

fn sleeper(scratch: &Path) -> Vec<u8> {
    packed(&python_bundle(
        scratch,
        "sleeper",
        "import time\ntime.sleep(10_000)\n",
    ))
}

fn quick(scratch: &Path) -> std::path::PathBuf {
    python_bundle(scratch, "quick", &python_agent("say(hold)"))
}

fn shards_of(order: &[Worked], evaluation: &str) -> usize {
    order
        .iter()
        .filter(|unit| unit.kind == "shard" && evaluation.ends_with(&unit.of))
        .count()
}

#[test]
fn sleeping_uploads_of_others_do_not_hold_a_running_evaluation() {
    // of two teams, and many of one
    for uploads in [[1, 1], [3, 0]] {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let server = Server::start(&scratch.path().join("data"), &with_startup_s(10.0));
        let quick_team = Team::create(&server, "Quick");
        let submission = quick_team.submit(&server, &quick(scratch.path()));
        assert_eq!(submission["state"], "valid", "{submission:#}");
        let before = worked(&server).len();
        let day = start_day(&server);
        let evaluation = path_of(&day, &submission);
        // in its middle
        let _ = server.poll(&evaluation, &quick_team.token, |answer| {
            answer["episodes_done"].as_u64() >= Some(2)
                || answer["state"] != "running" && answer["state"] != "queued"
        });
        let mut sleepers = Vec::new();
        for (index, count) in uploads.into_iter().enumerate() {
            let team = Team::create(&server, &format!("Sleeper {index}"));
            for _ in 0..count {
                sleepers.push(team.upload(&server, sleeper(scratch.path())));
            }
        }
        let finished = quick_team.finished(&server, &evaluation);
        assert_eq!(finished["state"], "finished", "{finished:#}");
        for id in &sleepers {
            let verdict = verdict_of(&server, id);
            assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        }
        let order = &worked(&server)[before..];
        assert_eq!(shards_of(order, &evaluation), 40);
        check_turns(
            order,
            |unit| unit.kind == "smoke",
            |unit| unit.kind == "shard",
        );
        let smokes = order.iter().filter(|unit| unit.kind == "smoke");
        assert_eq!(smokes.count(), sleepers.len(), "{order:#?}");
    }
}

fn verdict_of(server: &Server, submission: &str) -> Value {
    server.poll(
        &format!("/api/v1/submissions/{submission}"),
        &server.admin_token,
        |answer| answer["state"] != "validating",
    )
}

#[test]
fn a_slow_evaluation_shares_with_a_quick_one_and_ablations_have_what_is_left() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams: BTreeMap<&str, (Team, Value)> = [
        // by sleep: on no machine is it quick
        (
            "Slow",
            "if message['step'] == 0: time.sleep(1.5)\nsay(hold)",
        ),
        ("Quick", "say(hold)"),
    ]
    .into_iter()
    .map(|(name, on_step)| {
        let team = Team::create(&server, name);
        let folder = python_bundle(scratch.path(), name, &python_agent(on_step));
        let submission = team.submit(&server, &folder);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        (name, (team, submission))
    })
    .collect();
    let before = worked(&server).len();
    let of_slow = teams["Slow"].1["id"].as_str().expect("an id");
    let ordered = server.post(
        &format!("/api/v1/submissions/{of_slow}/ablation"),
        &server.admin_token,
        &json!({ "episodes_per_task": 1 }),
    );
    assert_eq!(ordered.status().as_u16() / 100, 2, "ordering an ablation");
    let day = start_day(&server);
    let evaluations = ["Slow", "Quick"].map(|name| path_of(&day, &teams[name].1));
    for (path, name) in evaluations.iter().zip(["Slow", "Quick"]) {
        let finished = teams[name].0.finished(&server, path);
        assert_eq!(finished["state"], "finished", "{finished:#}");
    }
    let order = &worked(&server)[before..];
    let shard_of = |path: &str, unit: &Worked| unit.kind == "shard" && path.ends_with(&unit.of);
    let [slow, quick] = &evaluations;
    for path in &evaluations {
        assert_eq!(shards_of(order, path), 12);
    }
    check_turns(
        order,
        |unit| shard_of(slow, unit),
        |unit| shard_of(quick, unit),
    );
    // What counts is not kept by what does not: one unit may have been begun before the day was.
    let counts = |unit: &Worked| shard_of(slow, unit) || shard_of(quick, unit);
    let last = order.iter().rposition(counts).expect("they were played");
    let first = order.iter().position(counts).expect("they were played");
    assert!(
        order[first..=last]
            .iter()
            .all(|unit| counts(unit) || unit.kind == "finalise"),
        "{order:#?}"
    );
}
