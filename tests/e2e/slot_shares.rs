//! Teams share a server's *slots* (places for one running job each) fairly, whatever their agents do. The log of a real server
//! with one slot shows in which order it starts its jobs. An evaluation consists of *shards* (jobs of some episodes) and a
//! *scoring* job; a new upload gets a *validation run*.

use crate::{Team, evaluation_path, start_day};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    server::Server,
};
use serde_json::{Value, json};
use std::{collections::BTreeMap, path::Path};

/// One slot and small shards. A test with sleeping agents lowers the time limit for the start of an agent.
const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
tasks = ["prepare"]
episodes_per_task = 12
episodes_per_shard = 1
[workers]
slots = 1
"#
);

/// Episodes of an evaluation with [`CONFIG`], one per shard.
const EPISODES: usize = 12;
/// Episodes of an evaluation that runs for a while, with [`with_startup_limit`].
const MANY_EPISODES: usize = 40;

/// A configuration with this time limit for the start of an agent.
fn with_startup_limit(limit_s: f64) -> String {
    let replacements = [
        ("startup_s = 600.0", format!("startup_s = {limit_s:.1}")),
        (
            "episodes_per_task = 12",
            format!("episodes_per_task = {MANY_EPISODES}"),
        ),
    ];
    replacements
        .iter()
        .fold(CONFIG.to_owned(), |config, (from, to)| {
            assert!(config.contains(from), "{from}");
            config.replace(from, to)
        })
}

/// A job that the slot ran, from the log.
#[derive(Debug, Clone, PartialEq)]
struct LoggedJob {
    /// `validation` of a submission, `shard` of an evaluation or ablation, `scoring` of an evaluation.
    kind: &'static str,
    /// Id of the submission, evaluation or ablation.
    subject: String,
    /// Milliseconds since midnight, as for `end_ms`.
    start_ms: i64,
    end_ms: i64,
}

impl LoggedJob {
    fn duration_ms(&self) -> i64 {
        self.end_ms - self.start_ms
    }
}

/// The time stamp of a log line, such as `2026-03-01T10:00:00.123456Z`, in milliseconds since midnight.
fn time_ms(line: &str) -> i64 {
    let time = line.split_once('T').expect("a time stamp").1;
    let number = |range: std::ops::Range<usize>| -> i64 { time[range].parse().expect("digits") };
    ((number(0..2) * 60 + number(3..5)) * 60 + number(6..8)) * 1000 + number(9..12)
}

/// All jobs that the server has started, in order.
fn logged_jobs(server: &Server) -> Vec<LoggedJob> {
    /// Length of a UUID as text.
    const ID_LENGTH: usize = 36;
    let mut jobs_by_id: Vec<(String, LoggedJob)> = Vec::new();
    for line in server.log().lines() {
        let Some((_, rest)) = line.split_once("faceoff_worker::slot: ") else {
            continue;
        };
        let field = |name: &str| rest.split_once(name).map(|(_, rest)| rest.to_owned());
        let id = field("job=").expect("a job id")[..ID_LENGTH].to_owned();
        if rest.starts_with("started") {
            let description = field("description=").expect("a description");
            let (kind, text_before_id) = if description.starts_with("validation run") {
                ("validation", "submission ")
            } else if description.starts_with("scoring") {
                ("scoring", "evaluation ")
            } else {
                ("shard", " of ")
            };
            let subject = description.split_once(text_before_id).expect("a subject").1[..ID_LENGTH]
                .to_owned();
            // The slot ends each job before it starts the next. The end of the last job is not used.
            let job = LoggedJob {
                kind,
                subject,
                start_ms: time_ms(line),
                end_ms: time_ms(line),
            };
            jobs_by_id.push((id, job));
        } else {
            let job = jobs_by_id.iter_mut().rfind(|job| job.0 == id);
            job.expect("the job was started before").1.end_ms = time_ms(line);
        }
    }
    jobs_by_id.into_iter().map(|job| job.1).collect()
}

/// Asserts that two kinds of jobs get equal slot time while both are pending. One kind gets several jobs in a row only while
/// the other kind has had more time, and these jobs take no longer than the other kind's longest job. This holds on a slow
/// machine, too.
fn assert_fair_shares(
    jobs: &[LoggedJob],
    is_first_kind: impl Fn(&LoggedJob) -> bool,
    is_second_kind: impl Fn(&LoggedJob) -> bool,
) {
    for (is_kind, is_other_kind) in [
        (
            &is_first_kind as &dyn Fn(&LoggedJob) -> bool,
            &is_second_kind as &dyn Fn(&LoggedJob) -> bool,
        ),
        (&is_second_kind, &is_first_kind),
    ] {
        let jobs_of_both: Vec<&LoggedJob> = jobs
            .iter()
            .filter(|job| is_first_kind(job) || is_second_kind(job))
            .collect();
        // Before the first and after the last job of the other kind, none of it is pending.
        let others = || {
            jobs_of_both
                .iter()
                .enumerate()
                .filter(|(_, job)| is_other_kind(job))
        };
        let first = others().next().expect("there are jobs of the other kind").0;
        let last = others()
            .next_back()
            .expect("there are jobs of the other kind")
            .0;
        let longest_ms = others().map(|(_, job)| job.duration_ms()).max();
        // The time between a claim and its line in the log belongs to no job: at most 2 s.
        let longest_ms = longest_ms.unwrap_or_default() + 2000;
        for in_a_row in jobs_of_both[first..last].chunk_by(|a, b| is_kind(a) == is_kind(b)) {
            if is_kind(in_a_row[0]) {
                // When the last of these jobs started, this kind had not had more time than the other.
                let before_last_ms: i64 = in_a_row[..in_a_row.len() - 1]
                    .iter()
                    .map(|job| job.duration_ms())
                    .sum();
                assert!(before_last_ms <= longest_ms, "{in_a_row:#?}\nin {jobs:#?}");
            }
        }
    }
}

/// An agent that never answers.
fn sleeping_bundle(scratch: &Path) -> Vec<u8> {
    pack(&python_bundle(
        scratch,
        "sleeper",
        "import time\ntime.sleep(10_000)\n",
    ))
}

fn quick_bundle(scratch: &Path) -> std::path::PathBuf {
    python_bundle(scratch, "quick", &python_agent("say(hold)"))
}

/// The number of an evaluation's shards among the jobs.
fn count_shards(jobs: &[LoggedJob], evaluation: &str) -> usize {
    jobs.iter()
        .filter(|job| job.kind == "shard" && evaluation.ends_with(&job.subject))
        .count()
}

#[test]
fn running_evaluation_keeps_its_share_beside_sleeping_uploads() {
    // The numbers of uploads by two teams.
    for uploads in [[1, 1], [3, 0]] {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let server = Server::start(&scratch.path().join("data"), &with_startup_limit(10.0));
        let quick_team = Team::create(&server, "Quick");
        let submission = quick_team.submit(&server, &quick_bundle(scratch.path()));
        assert_eq!(submission["state"], "valid", "{submission:#}");
        let earlier_jobs = logged_jobs(&server).len();
        let day = start_day(&server);
        let evaluation = evaluation_path(&day, &submission);
        // Waits until the evaluation runs.
        let _ = server.poll(&evaluation, &server.admin_token, |answer| {
            answer["progress"]["episodes_done"].as_u64() >= Some(2)
                || answer["state"] != "running" && answer["state"] != "queued"
        });
        let mut sleepers = Vec::new();
        for (index, count) in uploads.into_iter().enumerate() {
            let team = Team::create(&server, &format!("Sleeper {index}"));
            for _ in 0..count {
                sleepers.push(team.upload(&server, sleeping_bundle(scratch.path())));
            }
        }
        let finished = quick_team.wait_until_finished(&server, &evaluation);
        assert_eq!(finished["state"], "finished", "{finished:#}");
        for id in &sleepers {
            let verdict = verdict_of(&server, id);
            assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        }
        let jobs = &logged_jobs(&server)[earlier_jobs..];
        assert_eq!(count_shards(jobs, &evaluation), MANY_EPISODES);
        assert_fair_shares(
            jobs,
            |job| job.kind == "validation",
            |job| job.kind == "shard",
        );
        let validations = jobs.iter().filter(|job| job.kind == "validation");
        assert_eq!(validations.count(), sleepers.len(), "{jobs:#?}");
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
fn evaluations_share_slots_and_ablations_run_after_them() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams: BTreeMap<&str, (Team, Value)> = [
        // This agent sleeps, so it is slow on every machine.
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
    let earlier_jobs = logged_jobs(&server).len();
    let slow_id = teams["Slow"].1["id"].as_str().expect("an id");
    let requested = server.post(
        &format!("/api/v1/submissions/{slow_id}/ablation"),
        &server.admin_token,
        &json!({ "episodes_per_task": 1 }),
    );
    assert_eq!(
        requested.status().as_u16() / 100,
        2,
        "requesting an ablation"
    );
    let day = start_day(&server);
    let evaluations = ["Slow", "Quick"].map(|name| evaluation_path(&day, &teams[name].1));
    for (path, name) in evaluations.iter().zip(["Slow", "Quick"]) {
        let finished = teams[name].0.wait_until_finished(&server, path);
        assert_eq!(finished["state"], "finished", "{finished:#}");
    }
    let jobs = &logged_jobs(&server)[earlier_jobs..];
    let is_shard_of =
        |path: &str, job: &LoggedJob| job.kind == "shard" && path.ends_with(&job.subject);
    let [slow, quick] = &evaluations;
    for path in &evaluations {
        assert_eq!(count_shards(jobs, path), EPISODES);
    }
    assert_fair_shares(
        jobs,
        |job| is_shard_of(slow, job),
        |job| is_shard_of(quick, job),
    );
    // Ablations do not delay the day. One job of the ablation may have started before the day.
    let is_of_day = |job: &LoggedJob| is_shard_of(slow, job) || is_shard_of(quick, job);
    let last = jobs
        .iter()
        .rposition(is_of_day)
        .expect("both evaluations are finished");
    let first = jobs
        .iter()
        .position(is_of_day)
        .expect("both evaluations are finished");
    assert!(
        jobs[first..=last]
            .iter()
            .all(|job| is_of_day(job) || job.kind == "scoring"),
        "{jobs:#?}"
    );
}
