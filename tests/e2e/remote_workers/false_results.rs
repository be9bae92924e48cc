//! False results from a remote worker: it takes jobs like any other worker and reports results that it never computed. The
//! tests write the messages of the workers' protocol by hand. There, `order` is a job, `outcomes` are results, `asks` are
//! requests of workers, and `handed_in` announces a sent result. A *lease* is the right to run a job once; a *grant* is its
//! secret for the transfer of files. A *nonce* distinguishes the leases of one job.

use super::{
    EPISODES, ReferenceRun, RemoteSetup, fake_worker::FakeWorker, local_config, queue_evaluation,
    resume, server_config, start_server, worker_config,
};
use crate::{
    commands::admin,
    tournament::{OPEN_CUP, create_teams_with_hold},
};
use async_nats::jetstream;
use faceoff_tests::{
    nats::Nats,
    relay::Relay,
    server::{Server, http},
    worker::Worker,
};
use futures::StreamExt as _;
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    time::Duration,
};
use tokio::runtime::Runtime;

/// A real worker's result of a job, in a season with another secret. Seeds of episodes depend on it, so the episodes differ
/// from those of other seasons.
struct OtherSeasonResult {
    message: Value,
    /// Names and contents of the recording's files.
    files: Vec<(String, Vec<u8>)>,
}

impl OtherSeasonResult {
    /// Results of all jobs of an evaluation but the last, whose result would let the server join the recordings.
    fn compute_all(folder: &Path) -> Vec<Self> {
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        let data_dir = folder.join("data");
        let _ = queue_evaluation(&data_dir, folder, &local_config());
        let nats = Nats::start(&folder.join("nats"));
        let file_relay = Relay::start();
        let server = Server::start(&data_dir, &server_config(&nats, file_relay.address()));
        file_relay.set_target(server.address().into());
        let runtime = Runtime::new().expect("a runtime starts");
        let mut messages = runtime.block_on(async {
            let client = async_nats::connect(nats.url()).await;
            let messages = client
                .expect("NATS is there")
                .subscribe("faceoff.outcomes.>")
                .await;
            messages.expect("the test may subscribe")
        });
        let _worker = Worker::start(folder, "honest", &worker_config(nats.address(), 1));
        resume(&server);
        let mut results: Vec<Self> = Vec::new();
        while results.len() + 1 < 3 * EPISODES as usize {
            let message = runtime.block_on(messages.next()).expect("NATS is there");
            let message: Value = serde_json::from_slice(&message.payload).expect("it is JSON");
            // A job whose lease ended is run again.
            if message["outcome"]["kind"] == "done"
                && !results
                    .iter()
                    .any(|result| result.episode() == first_outcome(&message))
            {
                results.push(Self::read(message, &data_dir));
            }
        }
        server.kill();
        results
    }

    /// Reads the recording. Its files are stored before the result is sent.
    fn read(message: Value, data_dir: &Path) -> Self {
        let key = message["outcome"]["report"]["recording"].as_str();
        let recording = data_dir
            .join("artifacts")
            .join(key.expect("a shard is recorded"));
        let files = fs::read_dir(recording).expect("the recording is there");
        let files = files.map(|file| {
            let file = file.expect("a folder can be read");
            let name = file.file_name().into_string().expect("names are text");
            (name, fs::read(file.path()).expect("a file can be read"))
        });
        Self {
            files: files.collect(),
            message,
        }
    }

    /// Task and number of the job's episode.
    fn episode(&self) -> (&Value, &Value) {
        first_outcome(&self.message)
    }

    /// Whether a job is for the same task, with the same number of its episode.
    fn matches_job(&self, job: &Value) -> bool {
        let spec = &job["order"]["assignment"]["spec"];
        self.episode() == (&spec["task"], &spec["episodes"]["start"])
    }

    /// Report and files of the recording, changed so that they name this job.
    fn adapted_to(&self, job: &Value) -> (Value, Vec<(String, Vec<u8>)>) {
        let assignment = &job["order"]["assignment"];
        let mut report = self.message["outcome"]["report"].clone();
        report["recording"] = assignment["keeps"]["recording"].clone();
        let files = self.files.iter().map(|(name, bytes)| {
            if name != "shard.json" {
                return (name.clone(), bytes.clone());
            }
            let mut shard: Value = serde_json::from_slice(bytes).expect("it is JSON");
            shard["spec"] = assignment["spec"].clone();
            (name.clone(), shard.to_string().into_bytes())
        });
        (report, files.collect())
    }
}

/// Task and number of the first episode in a result message.
fn first_outcome(message: &Value) -> (&Value, &Value) {
    let outcome = &message["outcome"]["report"]["outcomes"][0];
    (&outcome["task"], &outcome["episode"])
}

/// Uploads a file of a job's recording as its worker does.
fn upload_file(job: &Value, name: &str, bytes: Vec<u8>) {
    let text = |field: &str| {
        job[field]
            .as_str()
            .expect("a job has this field")
            .to_owned()
    };
    let client = http().build().expect("a client needs nothing");
    let response = client
        .put(format!("{}/work/files/{name}", text("files")))
        .header("authorization", format!("Grant {}", text("grant")))
        .body(bytes)
        .send()
        .expect("the server answers");
    assert_eq!(response.status(), 204, "{name}");
}

#[test]
fn recording_of_other_episodes_is_rejected_and_worker_banned() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let other_results = OtherSeasonResult::compute_all(&scratch.path().join("another"));
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = start_server(
        &reference_run,
        &server_config(&nats, file_relay.address()),
        &file_relay,
    );
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let fake = runtime.block_on(FakeWorker::connect(&nats));
    let (job, other_result) = loop {
        let job = runtime.block_on(fake.take_job());
        let mut results = other_results.iter();
        if let Some(result) = results.find(|result| result.matches_job(&job)) {
            break (job, result);
        }
    };
    let (report, recording) = other_result.adapted_to(&job);
    for (name, bytes) in recording {
        upload_file(&job, &name, bytes);
    }
    runtime.block_on(fake.send_report(&job, report));
    server.wait_for_log("a worker is banned", 1);
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    let reason = view["bans"][0]["reason"].as_str().unwrap_or_default();
    // The recording is complete and consistent; only the simulation shows the difference.
    assert!(
        reason.contains("steps.parquet, ") && reason.contains(", expected "),
        "{view:#}"
    );
    let other = Worker::start(scratch.path(), "other", &worker_config(nats.address(), 1));
    reference_run.assert_equal_result(&server);
    other.stop();
}

#[test]
fn missing_result_message_requeues_job() {
    let setup = RemoteSetup::start();
    resume(&setup.server);
    let runtime = Runtime::new().expect("a runtime starts");
    let fake = runtime.block_on(FakeWorker::connect(&setup.nats));
    let job = runtime.block_on(fake.take_job());
    // For the server a false announcement looks like a loss in NATS: it finds no result message with this sequence number.
    let announcement = json!({
        "kind": "handed_in", "lease": job["order"]["lease"], "episodes_done": 1, "sequence": 1_000_000,
    });
    assert_eq!(runtime.block_on(fake.request(&announcement))["kind"], "yes");
    setup
        .server
        .wait_for_log("NATS has lost a result: the job is queued again", 1);
    let other = setup.start_worker("other");
    setup.assert_equal_result();
    other.stop();
}

#[test]
fn repeated_late_stolen_and_forged_results_change_nothing() {
    let setup = RemoteSetup::start();
    let runtime = Runtime::new().expect("a runtime starts");
    let (fake, mut messages) = runtime.block_on(async {
        let client = async_nats::connect(setup.nats.url()).await;
        let client = client.expect("NATS is there");
        let messages = client.subscribe("faceoff.outcomes.honest").await;
        (
            FakeWorker {
                client: client.clone(),
            },
            messages.expect("the test may subscribe"),
        )
    });
    let honest = setup.start_worker("honest");
    resume(&setup.server);
    let shards = 3 * EPISODES as usize;
    let mut results = Vec::new();
    runtime.block_on(async {
        // The subscription delivers the repeated messages, too.
        let mut nonces = BTreeSet::new();
        while nonces.len() < shards {
            let message = messages.next().await.expect("NATS is there");
            let result: Value = serde_json::from_slice(&message.payload).expect("it is JSON");
            if result["outcome"]["kind"] != "done"
                || !nonces.insert(result["lease"]["nonce"].to_string())
            {
                continue;
            }
            fake.repeat_result(&result, "early").await;
            results.push(result);
        }
    });
    setup.assert_equal_result();
    runtime.block_on(async {
        for result in &results {
            fake.repeat_result(result, "late").await;
        }
    });
    // The server processes all messages and accepts no repeated one.
    setup
        .server
        .wait_for_log("without a valid grant", 2 * shards);
    runtime.block_on(async {
        let jetstream = jetstream::new(fake.client.clone());
        loop {
            let stream = jetstream.get_stream("faceoff-outcomes").await;
            if stream
                .expect("the stream exists")
                .cached_info()
                .state
                .messages
                == 0
            {
                return;
            }
            // NATS sends no event when a stream is empty.
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    });
    let log = setup.server.log();
    let is_accepted_from_thief =
        |line: &str| line.contains("result accepted job=") && line.contains("worker=thief");
    assert!(!log.lines().any(is_accepted_from_thief), "{log}");
    assert!(log.contains("over already"), "{log}");
    let view = setup
        .server
        .get("/api/v1/workers", Some(&setup.server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    assert_eq!(view["bans"], json!([]), "{view:#}");
    setup.assert_equal_result();
    honest.stop();
}

#[test]
fn false_result_bans_worker_and_requeues_its_jobs() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let config = server_config(&nats, file_relay.address());
    let server = Server::start(&reference_run.data_dir, &config);
    file_relay.set_target(server.address().into());
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let admission_request = json!({
        "kind": "may_work", "program": "0".repeat(64), "version": "1", "runtimes": [], "slots": 1,
    });
    let fake = runtime.block_on(async {
        let fake = FakeWorker::connect(&nats).await;
        let (reported_job, other_job) = (fake.take_job().await, fake.take_job().await);
        fake.report_shard(&reported_job).await;
        server.wait_for_log("a worker is banned", 1);
        // The banned worker loses its other lease and gets no more jobs.
        let lease = &other_job["order"]["lease"];
        let renewal = json!({ "kind": "renew", "lease": lease, "episodes_done": 0 });
        assert_eq!(fake.request(&renewal).await["kind"], "no");
        let answer = fake.request(&admission_request).await;
        let reason = answer["reason"].as_str().expect("a refusal has a reason");
        assert!(
            reason.contains("accepts no results of this worker"),
            "{answer:#}"
        );
        fake
    });
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    assert_eq!(view["bans"][0]["worker"], "liar", "{view:#}");
    let reason = view["bans"][0]["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("differs from the simulation") && reason.contains("damaged or incomplete"),
        "{reason}"
    );

    // The ban survives a restart.
    server.kill();
    let server = Server::start(&reference_run.data_dir, &config);
    file_relay.set_target(server.address().into());
    let honest = Worker::start(scratch.path(), "honest", &worker_config(nats.address(), 1));
    reference_run.assert_equal_result(&server);
    let answer = runtime.block_on(fake.request(&admission_request));
    assert_eq!(answer["kind"], "no", "{answer:#}");
    let listed = admin(&server, &["worker", "list"]).expect_success();
    assert!(
        listed.contains("liar") && listed.contains("banned since") && listed.contains("honest"),
        "{listed}"
    );
    let readmitted = admin(&server, &["worker", "readmit", "liar"]).expect_success();
    assert_eq!(readmitted.trim(), "liar is readmitted");
    let answer = runtime.block_on(fake.request(&admission_request));
    let reason = answer["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("another program"),
        "a readmitted worker is checked like any other: {answer:#}"
    );
    honest.stop();
}

/// A process that keeps others from writing to a database.
struct WriteLock {
    process: Child,
}

impl WriteLock {
    fn take(database: &Path) -> Self {
        let script = "import sqlite3, sys\n\
                      database = sqlite3.connect(sys.argv[1], timeout=600, isolation_level=None)\n\
                      database.execute('BEGIN IMMEDIATE')\n\
                      print('locked', flush=True)\n\
                      sys.stdin.read()";
        let mut process = Command::new("python3")
            .args(["-c", script])
            .arg(database)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python3 starts");
        let output = process.stdout.as_mut().expect("its output is a pipe");
        let mut line = String::new();
        BufReader::new(output)
            .read_line(&mut line)
            .expect("python3 prints text");
        assert_eq!(line, "locked\n");
        Self { process }
    }
}

impl Drop for WriteLock {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Before each check of a result the server counts it in a file, so that a result whose checks always end the server is noticed.
#[test]
fn result_whose_checks_never_end_bans_its_worker() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let reference_run = ReferenceRun::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let config = server_config(&nats, file_relay.address());
    let start = || {
        let server = Server::start(&reference_run.data_dir, &config);
        file_relay.set_target(server.address().into());
        server
    };
    let server = start();
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let fake = runtime.block_on(FakeWorker::connect(&nats));
    let job = runtime.block_on(fake.take_job());
    let nonce = job["order"]["lease"]["nonce"].as_str();
    let check_count_file = reference_run
        .data_dir
        .join("result-checks")
        .join(nonce.expect("a lease has a nonce"));
    // The check cannot store the result while the database is locked, and is interrupted by the end of the server.
    let lock = WriteLock::take(&reference_run.data_dir.join("faceoff.sqlite3"));
    runtime.block_on(fake.report_failure(&job, "first"));
    while !check_count_file.exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    server.kill();
    drop(lock);
    let started_checks = fs::read_to_string(&check_count_file).expect("the check has not ended");
    assert_eq!(started_checks, "1");
    // As after two more checks that did not end.
    fs::write(&check_count_file, "3").expect("a scratch file can be written");
    let server = start();
    runtime.block_on(fake.report_failure(&job, "second"));
    server.wait_for_log("a worker is banned", 1);
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    let reason = view["bans"][0]["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("three checks of the worker's result"),
        "{view:#}"
    );
    let honest = Worker::start(scratch.path(), "honest", &worker_config(nats.address(), 1));
    reference_run.assert_equal_result(&server);
    honest.stop();
    assert!(
        !check_count_file.exists(),
        "the number of checks is forgotten"
    );
}

#[test]
fn false_game_result_bans_worker_and_real_one_is_accepted() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &server_config(&nats, file_relay.address()),
    );
    file_relay.set_target(server.address().into());
    create_teams_with_hold(&server, &["Ada", "Bob"]);
    let cup = admin(&server, &OPEN_CUP).json();
    let round = admin(&server, &["tournament", "start-round", "Cup"]);
    let _ = round.expect_success();

    let runtime = Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let fake = FakeWorker::connect(&nats).await;
        let job = fake.take_job().await;
        assert_eq!(job["order"]["assignment"]["kind"], "game", "{job:#}");
        fake.report_game(&job).await;
        server.wait_for_log("a worker is banned", 1);
    });
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    let reason = view["bans"][0]["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("game.zip was not stored"), "{view:#}");

    let honest = Worker::start(scratch.path(), "honest", &worker_config(nats.address(), 1));
    let id = cup["id"].as_str().expect("a tournament has an id");
    let path = format!("/api/v1/tournaments/{id}");
    let _ = server.poll(&path, &server.admin_token, |view| view["phase"] == "played");
    let games = server.get(&format!("{path}/games"), Some(&server.admin_token));
    let games: Value = games.json().expect("the API speaks JSON");
    assert!(games.to_string().contains("\"steps\":1500"), "{games:#}");
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    assert_eq!(view["bans"].as_array().map(Vec::len), Some(1), "{view:#}");
    honest.stop();
}
