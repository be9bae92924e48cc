//! A worker that lies: it takes an order as any other, and reports what it never played.

use crate::{
    Team,
    commands::admin,
    elsewhere::{Contest, giving, resume, taking},
};
use async_nats::{
    Client, HeaderMap,
    jetstream::{self, consumer::PullConsumer},
};
use faceoff_tests::{nats::Nats, relay::Relay, repository, server::Server, worker::Worker};
use futures::StreamExt as _;
use serde_json::{Value, json};

/// Somebody who speaks as workers do, and is none.
struct Liar {
    client: Client,
}

impl Liar {
    /// Where it is answered it says as a worker does; nobody else is answered.
    async fn connect(nats: &Nats) -> Result<Client, async_nats::ConnectError> {
        let options = async_nats::ConnectOptions::new().custom_inbox_prefix("_INBOX.faceoff.liar");
        options.connect(nats.url()).await
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

    async fn tells(&self, order: &Value, report: Value) {
        let lease = &order["order"]["lease"];
        let told = json!({
            "lease": lease, "grant": order["grant"], "outcome": { "kind": "done", "report": report },
        });
        let mut headers = HeaderMap::new();
        let id = [&lease["unit"], &lease["nonce"]].map(|id| id.as_str().expect("an id is a text"));
        headers.insert("Nats-Msg-Id", id.join("/"));
        let words = serde_json::to_vec(&told).expect("it is JSON");
        let sent = jetstream::new(self.client.clone())
            .publish_with_headers("faceoff.outcomes.liar", headers, words.into())
            .await;
        sent.expect("NATS is there")
            .await
            .expect("NATS takes outcomes");
    }
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
    let runtime = tokio::runtime::Runtime::new().expect("a runtime starts");
    let may_work = json!({
        "kind": "may_work", "program": "0".repeat(64), "version": "1", "runtimes": [], "slots": 1,
    });
    let liar = runtime.block_on(async {
        let client = Liar::connect(&nats).await;
        let liar = Liar {
            client: client.expect("NATS is there"),
        };
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

    let runtime = tokio::runtime::Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let client = Liar::connect(&nats).await;
        let liar = Liar {
            client: client.expect("NATS is there"),
        };
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
