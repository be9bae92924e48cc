//! A worker that lies: it takes an order as any other, and reports what it never played.

use super::{Contest, EPISODES, alone, giving, queued, resume, serving, taking};
use crate::{Team, commands::admin};
use async_nats::{
    Client, HeaderMap,
    jetstream::{self, consumer::PullConsumer},
};
use faceoff_tests::{
    nats::Nats,
    relay::Relay,
    repository,
    server::{Server, http},
    worker::Worker,
};
use futures::StreamExt as _;
use serde_json::{Value, json};
use std::{collections::BTreeSet, fs, path::Path, time::Duration};
use tokio::runtime::Runtime;

/// Somebody who speaks as workers do, and is none.
struct Liar {
    client: Client,
}

impl Liar {
    /// Where it is answered it says as a worker does; nobody else is answered.
    async fn of(nats: &Nats) -> Self {
        let options = async_nats::ConnectOptions::new().custom_inbox_prefix("_INBOX.faceoff.liar");
        let client = options.connect(nats.url()).await;
        Self {
            client: client.expect("NATS is there"),
        }
    }

    async fn asks(&self, question: &Value) -> Value {
        let words = serde_json::to_vec(question).expect("it is JSON");
        let answer = self.client.request("faceoff.asks.liar", words.into()).await;
        let answer = answer.expect("the server answers");
        serde_json::from_slice(&answer.payload).expect("an answer is JSON")
    }

    /// Takes an order and makes it its own.
    async fn begins(&self) -> Value {
        let jetstream = jetstream::new(self.client.clone());
        loop {
            let consumer: Result<PullConsumer, _> = jetstream
                .get_consumer_from_stream("workers", "faceoff-orders")
                .await;
            let Ok(consumer) = consumer else {
                // The server has not made it yet.
                tokio::time::sleep(std::time::Duration::from_millis(100)).await;
                continue;
            };
            let orders = consumer.batch().max_messages(1).messages().await;
            let Some(Ok(order)) = orders.expect("NATS is there").next().await else {
                continue;
            };
            order.ack().await.expect("NATS is there");
            let order: Value = serde_json::from_slice(&order.payload).expect("an order is JSON");
            let begin =
                json!({ "kind": "begin", "lease": order["order"]["lease"], "slot": "slot-0" });
            if self.asks(&begin).await["kind"] == "yes" {
                return order;
            }
        }
    }

    /// Reports a success that nobody has played.
    async fn reports(&self, order: &Value) {
        let assignment = &order["order"]["assignment"];
        let spec = &assignment["spec"];
        let outcome = json!({
            "task": spec["task"], "episode": spec["episodes"]["start"], "steps": 20, "end": "horizon", "success": true,
            "violations": { "ee": false, "link": false, "joint_pos": false, "joint_vel": false },
            "computation_time": { "mean_s": 0.001, "max_s": 0.002 }, "fault": null
        });
        let report = json!({
            "kind": "play", "outcomes": [outcome], "log": "", "stopped_by_faults": false,
            "recording": assignment["keeps"]["recording"],
        });
        self.tells(order, report).await;
    }

    /// Reports the result of a game that nobody has played.
    async fn reports_a_game(&self, order: &Value) {
        let hash = "0".repeat(64);
        let report = json!({
            "kind": "game", "score": { "winner": "first" }, "logs": ["", ""],
            "recording": {
                "key": order["order"]["assignment"]["recording"], "game_blake3": hash, "side_blake3": [hash, hash],
            },
        });
        self.tells(order, report).await;
    }

    /// Tells once more what a worker has told: as that worker, as another with another end, and with a lease that nobody gave it.
    async fn repeats(&self, told: &Value, when: &str) {
        let mut stolen = told.clone();
        let success = &mut stolen["outcome"]["report"]["outcomes"][0]["success"];
        *success = json!(!success.as_bool().unwrap_or_default());
        let mut forged = told.clone();
        forged["lease"]["nonce"] = json!("00000000-0000-4000-8000-000000000000");
        let nonce = told["lease"]["nonce"].as_str().expect("a lease has it");
        for (subject, told, what) in [
            ("faceoff.outcomes.honest", told, "again"),
            ("faceoff.outcomes.thief", told, "as a thief"),
            ("faceoff.outcomes.thief", &stolen, "otherwise"),
            ("faceoff.outcomes.honest", &forged, "forged"),
        ] {
            // NATS would not store the same twice.
            self.publishes(subject, &format!("{nonce} {what} {when}"), told)
                .await;
        }
    }

    async fn tells(&self, order: &Value, report: Value) {
        let lease = &order["order"]["lease"];
        let told = json!({
            "lease": lease, "grant": order["grant"], "outcome": { "kind": "done", "report": report },
        });
        let id = [&lease["unit"], &lease["nonce"]].map(|id| id.as_str().expect("an id is a text"));
        self.publishes("faceoff.outcomes.liar", &id.join("/"), &told)
            .await;
    }

    async fn publishes(&self, subject: &'static str, id: &str, told: &Value) {
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", id);
        let words = serde_json::to_vec(told).expect("it is JSON");
        let sent = jetstream::new(self.client.clone())
            .publish_with_headers(subject, headers, words.into())
            .await;
        sent.expect("NATS is there")
            .await
            .expect("NATS takes outcomes");
    }
}

/// What an honest worker made of its first unit where another season's secret draws the episodes.
struct Honest {
    outcome: Value,
    files: Vec<(String, Vec<u8>)>,
}

impl Honest {
    fn of_another_season(folder: &Path) -> Self {
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        let data = folder.join("data");
        let _ = queued(&data, folder, &alone());
        let nats = Nats::start(&folder.join("nats"));
        let files = Relay::start();
        let server = Server::start(&data, &giving(&nats, files.address()));
        files.lead_to(server.address().into());
        let runtime = Runtime::new().expect("a runtime starts");
        let mut told = runtime.block_on(async {
            let client = async_nats::connect(nats.url()).await;
            let told = client
                .expect("NATS is there")
                .subscribe("faceoff.outcomes.>")
                .await;
            told.expect("anyone may listen here")
        });
        let _worker = Worker::start(folder, "honest", &taking(nats.address(), 1));
        resume(&server);
        let outcome = loop {
            let message = runtime.block_on(told.next()).expect("NATS is there");
            let outcome: Value = serde_json::from_slice(&message.payload).expect("it is JSON");
            if outcome["outcome"]["kind"] == "done" {
                break outcome;
            }
        };
        // Files are stored before they are told of, and stay until all shards are there.
        server.kill();
        let key = outcome["outcome"]["report"]["recording"].as_str();
        let stored = data
            .join("artifacts")
            .join(key.expect("a shard is recorded"));
        let files = fs::read_dir(stored).expect("the recording is there");
        let files = files.map(|file| {
            let file = file.expect("a folder can be read");
            let name = file.file_name().into_string().expect("it is text");
            (name, fs::read(file.path()).expect("a file can be read"))
        });
        Self {
            outcome,
            files: files.collect(),
        }
    }

    /// Is an order for the same episodes of the same task?
    fn fits(&self, order: &Value) -> bool {
        let spec = &order["order"]["assignment"]["spec"];
        let played = &self.outcome["outcome"]["report"]["outcomes"][0];
        played["task"] == spec["task"] && played["episode"] == spec["episodes"]["start"]
    }

    /// As if it had been played by this order.
    fn of(&self, order: &Value) -> (Value, Vec<(String, Vec<u8>)>) {
        let assignment = &order["order"]["assignment"];
        let mut report = self.outcome["outcome"]["report"].clone();
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

/// Stores a file of an order as its worker does.
fn store(order: &Value, name: &str, bytes: Vec<u8>) {
    let text = |field: &str| order[field].as_str().expect("an order has it").to_owned();
    let client = http().build().expect("a client needs nothing");
    let stored = client
        .put(format!("{}/work/files/{name}", text("files")))
        .header("authorization", format!("Grant {}", text("grant")))
        .body(bytes)
        .send()
        .expect("the server answers");
    assert_eq!(stored.status(), 204, "{name}");
}

#[test]
fn a_whole_recording_of_other_episodes_than_the_ordered_ones_is_found_out() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let honest = Honest::of_another_season(&scratch.path().join("another"));
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let liar = runtime.block_on(Liar::of(&nats));
    let order = loop {
        let order = runtime.block_on(liar.begins());
        if honest.fits(&order) {
            break order;
        }
    };
    let (report, recording) = honest.of(&order);
    for (name, bytes) in recording {
        store(&order, &name, bytes);
    }
    runtime.block_on(liar.tells(&order, report));
    server.wait_for_log("a worker is banned", 1);
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let told: Value = told.json().expect("the API speaks JSON");
    let reason = told["bans"][0]["reason"].as_str().unwrap_or_default();
    // All is there and fits together; only the simulator tells otherwise.
    assert!(
        reason.contains("steps.parquet, ") && reason.contains(", expected "),
        "{told:#}"
    );
    let other = Worker::start(scratch.path(), "other", &taking(nats.address(), 1));
    contest.ends_alike(&server);
    other.end();
}

#[test]
fn what_is_said_to_be_handed_in_and_is_not_there_is_played_by_another() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let liar = runtime.block_on(Liar::of(&nats));
    let order = runtime.block_on(liar.begins());
    // Whether a worker lies or NATS has lost it, the server finds nothing there.
    let handed_in = json!({
        "kind": "handed_in", "lease": order["order"]["lease"], "episodes_done": 1, "sequence": 1_000_000,
    });
    assert_eq!(runtime.block_on(liar.asks(&handed_in))["kind"], "yes");
    server.wait_for_log("NATS has lost what came of a unit: it is played again", 1);
    let other = Worker::start(scratch.path(), "other", &taking(nats.address(), 1));
    contest.ends_alike(&server);
    other.end();
}

#[test]
fn what_is_told_twice_or_late_or_by_a_thief_or_with_a_forged_order_changes_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = serving(&contest, &giving(&nats, files.address()), &files);
    let runtime = Runtime::new().expect("a runtime starts");
    let (liar, mut heard) = runtime.block_on(async {
        let client = async_nats::connect(nats.url()).await;
        let client = client.expect("NATS is there");
        let heard = client.subscribe("faceoff.outcomes.honest").await;
        (
            Liar {
                client: client.clone(),
            },
            heard.expect("anyone may listen here"),
        )
    });
    let honest = Worker::start(scratch.path(), "honest", &taking(nats.address(), 1));
    resume(&server);
    let shards = 3 * EPISODES as usize;
    let mut all = Vec::new();
    runtime.block_on(async {
        // Of its own messages it hears the copies, too.
        let mut seen = BTreeSet::new();
        while seen.len() < shards {
            let message = heard.next().await.expect("NATS is there");
            let told: Value = serde_json::from_slice(&message.payload).expect("it is JSON");
            if told["outcome"]["kind"] != "done" || !seen.insert(told["lease"]["nonce"].to_string())
            {
                continue;
            }
            liar.repeats(&told, "at once").await;
            all.push(told);
        }
    });
    contest.ends_alike(&server);
    runtime.block_on(async {
        for told in &all {
            liar.repeats(told, "late").await;
        }
    });
    // All of it is taken, and none of it counts.
    server.wait_for_log("without the order that it is of", 2 * shards);
    runtime.block_on(async {
        let outcomes = jetstream::new(liar.client.clone());
        loop {
            let stream = outcomes.get_stream("faceoff-outcomes").await;
            if stream.expect("it is there").cached_info().state.messages == 0 {
                return;
            }
            // Nobody tells when it is empty.
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    });
    let log = server.log();
    let counts = |line: &str| line.contains("taken in unit=") && line.contains("worker=thief");
    assert!(!log.lines().any(counts), "{log}");
    assert!(log.contains("over already"), "{log}");
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let told: Value = told.json().expect("the API speaks JSON");
    assert_eq!(told["bans"], json!([]), "{told:#}");
    contest.ends_alike(&server);
    honest.end();
}

#[test]
fn a_worker_that_lies_is_banned_by_name_and_others_play_what_it_had() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = giving(&nats, files.address());
    let server = Server::start(&contest.data, &config);
    files.lead_to(server.address().into());
    resume(&server);
    let runtime = Runtime::new().expect("a runtime starts");
    let may_work = json!({
        "kind": "may_work", "program": "0".repeat(64), "version": "1", "runtimes": [], "slots": 1,
    });
    let liar = runtime.block_on(async {
        let liar = Liar::of(&nats).await;
        let (lied, kept) = (liar.begins().await, liar.begins().await);
        liar.reports(&lied).await;
        server.wait_for_log("a worker is banned", 1);
        // What else it has is no longer its own, and it gets nothing more.
        let lease = &kept["order"]["lease"];
        let renew = json!({ "kind": "renew", "lease": lease, "episodes_done": 0 });
        assert_eq!(liar.asks(&renew).await["kind"], "no");
        let told = liar.asks(&may_work).await;
        let why = told["reason"].as_str().expect("a refusal has a reason");
        assert!(why.contains("takes nothing of this worker"), "{told:#}");
        liar
    });
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let banned: Value = told.json().expect("the API speaks JSON");
    assert_eq!(banned["bans"][0]["worker"], "liar", "{banned:#}");
    let reason = banned["bans"][0]["reason"].as_str().unwrap_or_default();
    assert!(
        reason.contains("not what the simulator gives") && reason.contains("damaged or incomplete"),
        "{reason}"
    );

    // Not even a restart makes it forgotten.
    server.kill();
    let server = Server::start(&contest.data, &config);
    files.lead_to(server.address().into());
    let honest = Worker::start(scratch.path(), "honest", &taking(nats.address(), 1));
    contest.ends_alike(&server);
    let told = runtime.block_on(liar.asks(&may_work));
    assert_eq!(told["kind"], "no", "{told:#}");
    let listed = admin(&server, &["worker", "list"]).done();
    assert!(
        listed.contains("liar") && listed.contains("banned since") && listed.contains("honest"),
        "{listed}"
    );
    let readmitted = admin(&server, &["worker", "readmit", "liar"]).done();
    assert_eq!(readmitted.trim(), "liar is readmitted");
    let told = runtime.block_on(liar.asks(&may_work));
    let why = told["reason"].as_str().unwrap_or_default();
    assert!(why.contains("another program"), "as any other: {told:#}");
    honest.end();
}

#[test]
fn a_game_that_nobody_has_played_is_not_believed_and_one_that_was_played_elsewhere_is() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &giving(&nats, files.address()),
    );
    files.lead_to(server.address().into());
    for name in ["Ada", "Bob"] {
        let team = Team::create(&server, name);
        let submission = team.submit(&server, &repository().join("agents/hold"));
        assert_eq!(submission["state"], "valid", "{submission:#}");
    }
    let rules = [
        "--format",
        "round-robin",
        "--rounds",
        "1",
        "--steps",
        "1500",
    ];
    let open = ["tournament", "open", "Cup", "--teams", "Ada,Bob", "--json"];
    let cup = admin(&server, &[&open[..], &rules].concat()).json();
    let round = admin(&server, &["tournament", "start-round", "Cup"]);
    let _ = round.done();

    let runtime = Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let liar = Liar::of(&nats).await;
        let order = liar.begins().await;
        assert_eq!(order["order"]["assignment"]["kind"], "game", "{order:#}");
        liar.reports_a_game(&order).await;
        server.wait_for_log("a worker is banned", 1);
    });
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let told: Value = told.json().expect("the API speaks JSON");
    let reason = told["bans"][0]["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("game.zip was not stored"), "{told:#}");

    let honest = Worker::start(scratch.path(), "honest", &taking(nats.address(), 1));
    let path = cup["id"].as_str().expect("a tournament has an id");
    let path = format!("/api/v1/tournaments/{path}");
    let _ = server.poll(&path, &server.admin_token, |told| told["phase"] == "played");
    let games = server.get(&format!("{path}/games"), Some(&server.admin_token));
    let games: Value = games.json().expect("the API speaks JSON");
    assert!(games.to_string().contains("\"steps\":1500"), "{games:#}");
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let told: Value = told.json().expect("the API speaks JSON");
    assert_eq!(told["bans"].as_array().map(Vec::len), Some(1), "{told:#}");
    honest.end();
}
