//! Work on other machines, by a real NATS: real workers, links that are cut, and everything that can be killed.

use crate::{
    Team,
    kills::{Archive, assert_same, copy_folder, draw, outcome},
    path_of, start_day,
};
use async_nats::{ConnectOptions, Event, Message};
use bytes::Bytes;
use faceoff_tests::{
    bundle, nats::Nats, program, relay::Relay, repository, server::Server, worker::Worker,
};
use faceoff_wire::remote::{Ask, RemoteOrder};
use futures::StreamExt as _;
use serde_json::{Value, json};
use std::{
    fs,
    net::SocketAddr,
    path::{Path, PathBuf},
    process::Command,
    sync::mpsc,
    thread,
    time::Duration,
};

/// Of each task.
const EPISODES: u32 = 10;

const COMMON: &str = concat!(
    include_str!("../patient.toml"),
    r#"
[evaluation]
episodes_per_task = 10
episodes_per_shard = 1
[sandbox]
resident_bytes = 0
"#
);

/// Of a server whose own slots play.
fn alone() -> String {
    format!("{COMMON}[workers]\nslots = 1\n")
}

/// Of a server for which others play, and which they reach at `files`.
pub(crate) fn giving(nats: &Nats, files: SocketAddr) -> String {
    format!(
        "{COMMON}[workers]\nslots = 1\nplay = false\nlease_s = 10\n[nats]\nurl = \"{}\"\nfiles_url = \"http://{files}\"\n",
        nats.url()
    )
}

/// Of a worker that reaches NATS there.
pub(crate) fn taking(nats: SocketAddr, slots: usize) -> String {
    format!("{COMMON}[workers]\nslots = {slots}\n[nats]\nurl = \"nats://{nats}\"\n")
}

/// An evaluation of striker that is queued and that nobody has begun, in a data folder: its path, and the team.
fn queued(data: &Path, scratch: &Path) -> (String, Team) {
    let server = Server::start(data, &alone());
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::reference("striker", scratch));
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let pause = json!({ "reason": "Until all are there" });
    let paused = server.post("/api/v1/queue/pause", &server.admin_token, &pause);
    assert!(paused.status().is_success(), "{}", paused.status());
    let path = path_of(&start_day(&server), &submission);
    (path, team)
}

pub(crate) fn resume(server: &Server) {
    let resumed = server.post("/api/v1/queue/resume", &server.admin_token, &json!({}));
    assert!(resumed.status().is_success(), "{}", resumed.status());
}

/// An evaluation that others are to play, and what a slot of the server's own made of it.
pub(crate) struct Contest {
    /// Of a server on which it is queued.
    pub(crate) data: PathBuf,
    pub(crate) evaluation: String,
    pub(crate) team: Team,
    pub(crate) expected: (Value, Archive),
}

impl Contest {
    pub(crate) fn prepare(scratch: &Path) -> Self {
        let [data, calm] = ["data", "calm"].map(|name| scratch.join(name));
        let (evaluation, team) = queued(&data, scratch);
        copy_folder(&data, &calm);
        let undisturbed = Server::start(&calm, &alone());
        resume(&undisturbed);
        let expected = outcome(&undisturbed, &team, &evaluation);
        undisturbed.kill();
        Self {
            data,
            evaluation,
            team,
            expected,
        }
    }

    /// Waits for the end, and compares.
    pub(crate) fn ends_alike(self, server: &Server) {
        let found = outcome(server, &self.team, &self.evaluation);
        let evaluation = server.poll(&self.evaluation, &self.team.token, |_| true);
        let submission = evaluation["submission"].as_str().expect("it names it");
        let submission = self.team.verdict_so_far(server, submission);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        assert_eq!(assert_same(found, self.expected), 3 * EPISODES as usize);
    }
}

#[test]
fn what_others_play_is_what_one_slot_plays() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let past = scratch.path().join("past");
    let (evaluation, team) = queued(&past, scratch.path());
    let expected = || {
        let calm = scratch.path().join("calm");
        copy_folder(&past, &calm);
        let server = Server::start(&calm, &alone());
        resume(&server);
        outcome(&server, &team, &evaluation)
    };
    let mut expected = Some(expected());
    let nats = Nats::start(&scratch.path().join("nats"));
    for workers in [1, 2] {
        let data = scratch.path().join(format!("with-{workers}"));
        copy_folder(&past, &data);
        let files = Relay::start();
        let config = giving(&nats, files.address())
            .replace("[nats]", &format!("[nats]\nname = \"with-{workers}\""));
        let server = Server::start(&data, &config);
        files.lead_to(server.address().into());
        let workers: Vec<Worker> = (0..workers)
            .map(|index| {
                let config = taking(nats.address(), 1)
                    .replace("[nats]", &format!("[nats]\nname = \"with-{workers}\""));
                Worker::start(&data, &format!("worker-{index}"), &config)
            })
            .collect();
        resume(&server);
        let found = outcome(&server, &team, &evaluation);
        let same = expected.take().expect("it is put back");
        // The archives are read, not used up: they are opened anew for the next.
        let again = (same.0.clone(), same.1.clone());
        assert_eq!(assert_same(found, same), 3 * EPISODES as usize);
        expected = Some(again);
        for worker in workers {
            assert!(
                worker.log().contains("committed"),
                "each has played:\n{}",
                worker.log()
            );
            worker.end();
        }
    }
}

#[test]
fn a_worker_that_has_waited_begins_the_first_order_that_it_is_sent() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let server = Server::start(
        &scratch.path().join("data"),
        &giving(&nats, files.address()),
    );
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let runtime = tokio::runtime::Runtime::new().expect("a runtime starts");
    let client = runtime.block_on(async_nats::connect(nats.url()));
    let client = client.expect("NATS is there");
    let heard = runtime.block_on(client.subscribe("faceoff.>"));
    let mut heard = heard.expect("anyone may listen here");
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    runtime.block_on(async {
        let asks = |message: &Message| message.subject.starts_with("faceoff.free.");
        while !heard.next().await.is_some_and(|message| asks(&message)) {}
    });
    // Most of the time that a request for work is open.
    thread::sleep(Duration::from_secs(3));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.end();
    let (mut orders, mut begun) = (Vec::new(), Vec::new());
    runtime.block_on(async {
        let over = client.publish("faceoff.over", Bytes::new());
        over.await.expect("NATS is there");
        while let Some(message) = heard.next().await {
            match message.subject.as_str() {
                "faceoff.over" => break,
                "faceoff.orders" => {
                    let order: RemoteOrder =
                        serde_json::from_slice(&message.payload).expect("it is an order");
                    orders.push(order.order.lease.nonce);
                }
                "faceoff.asks.worker" => {
                    let ask = serde_json::from_slice(&message.payload);
                    if let Ask::Begin { lease, .. } = ask.expect("it is a question") {
                        // Who is not answered soon asks again.
                        if begun.last() != Some(&lease.nonce) {
                            begun.push(lease.nonce);
                        }
                    }
                }
                _ => {}
            }
        }
    });
    assert!(orders.len() >= 3 * EPISODES as usize, "{}", orders.len());
    assert_eq!(begun, orders);
}

/// What ends, without a word.
#[derive(Debug, Clone, Copy)]
enum Ends {
    Worker,
    Server,
    Nats,
    Link,
}

#[test]
#[expect(
    clippy::print_stdout,
    reason = "by its seed a run that failed is repeated"
)]
fn whoever_is_killed_or_cut_off_nothing_is_lost_and_nothing_done_twice() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let contest = Contest::prepare(scratch.path());
    let mut nats = Nats::start(&scratch.path().join("nats"));
    let nats_address = nats.address();
    let (files, link) = (Relay::start(), Relay::start());
    link.lead_to(nats_address);
    let config = giving(&nats, files.address());
    let mut server = Server::start(&contest.data, &config);
    files.lead_to(server.address().into());
    let killed = || Worker::start(scratch.path(), "killed", &taking(nats_address, 1));
    let mut mortal = killed();
    let stays = Worker::start(scratch.path(), "stays", &taking(link.address(), 1));
    resume(&server);

    // Who is killed when is drawn: after how many shards of the one that stays, and how far into the next.
    let seed = std::env::var("KILL_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok());
    let seed: u64 = seed.unwrap_or_else(|| {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.expect("the clock is right").as_secs()
    });
    println!("KILL_SEED={seed}");
    let mut draws = (seed << 20..).map(draw);
    let mut drawn = || draws.next().unwrap_or_default();
    let mut ends = [
        Ends::Worker,
        Ends::Worker,
        Ends::Server,
        Ends::Server,
        Ends::Nats,
        Ends::Link,
    ]
    .map(|end| (drawn(), end));
    ends.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    for (shards, (_, end)) in (1..).zip(ends) {
        stays.wait_for_log("committed", shards);
        std::thread::sleep(Duration::from_secs_f64(drawn()));
        match end {
            Ends::Worker => {
                drop(mortal);
                mortal = killed();
            }
            // It comes back at another place, to which the same address leads.
            Ends::Server => {
                server.kill();
                server = Server::start(&contest.data, &config);
                files.lead_to(server.address().into());
            }
            Ends::Nats => nats.kill_and_start(),
            // For longer than nothing, and then it is a slow one.
            Ends::Link => {
                link.cut();
                std::thread::sleep(Duration::from_secs_f64(3.0 * drawn()));
                link.lead_to(nats_address);
                link.delay(Duration::from_millis(200));
            }
        }
    }
    contest.ends_alike(&server);
}

#[test]
fn what_is_cancelled_stops_elsewhere_and_the_slot_goes_on() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let config = giving(&nats, files.address())
        .replace("episodes_per_task = 10", "episodes_per_task = 40")
        .replace("episodes_per_shard = 1", "episodes_per_shard = 40");
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    // No smoke run has so many control steps; each shard here has more.
    let hangs = bundle::python_agent(
        "seen = globals().setdefault('seen', [0])\nseen[0] += 1\nif seen[0] > 3000: time.sleep(600)\nsay(hold)",
    );
    let hangs = bundle::python_bundle(scratch.path(), "hangs", &hangs);
    let (slow, quick) = (
        Team::create(&server, "Slow"),
        Team::create(&server, "Quick"),
    );
    let of_slow = slow.submit(&server, &hangs);
    let of_quick = quick.submit(&server, &repository().join("agents/hold"));
    assert_eq!(of_slow["state"], "valid", "{of_slow:#}");
    let worker = Worker::start(scratch.path(), "worker", &taking(nats.address(), 1));
    let day = start_day(&server);
    let [of_slow, of_quick] = [&of_slow, &of_quick].map(|submission| path_of(&day, submission));
    let _ = server.poll(&of_slow, &slow.token, |answer| answer["state"] == "running");
    let cancelled = server.post(
        &format!("{of_slow}/cancel"),
        &server.admin_token,
        &json!({ "reason": "Its team asked for it" }),
    );
    assert!(cancelled.status().is_success(), "{}", cancelled.status());
    worker.wait_for_log("no longer this slot's", 1);
    let finished = quick.finished(&server, &of_quick);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    worker.end();
}

#[test]
fn a_worker_that_is_not_like_the_server_is_told_so_and_gets_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let files = Relay::start();
    let runtime = "[runtimes.other]\nread_only_paths = [\"/usr/lib\", \"/lib\", \"/lib64\"]\npath = \"/usr/bin\"\n";
    let config = giving(&nats, files.address()) + runtime;
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    let lacks = Worker::start(scratch.path(), "lacks", &taking(nats.address(), 1));
    lacks.wait_for_log("lacks runtimes that the server offers to agents: other", 1);
    // So does `doctor`, before a worker is started.
    for (runtimes, found) in [
        ("", "would give no work"),
        (runtime, "would give work to a worker \"asks\""),
    ] {
        let file = scratch.path().join("asks.toml");
        fs::write(&file, taking(nats.address(), 1) + runtimes).expect("a file can be written");
        let asked = Command::new(program("faceoff"))
            .args(["doctor", "--name", "asks", "--config"])
            .arg(&file)
            .output()
            .expect("the program can be started");
        let told = String::from_utf8_lossy(&asked.stdout);
        assert!(
            told.contains("nats-server 2.") && told.contains(found),
            "{told}"
        );
    }
    // Another server on the same streams says so, and answers nobody while the first works.
    let other = Server::start(&scratch.path().join("other"), &config);
    other.wait_for_log("is another server's", 1);

    // Strangers get no files.
    for header in [None, Some("Grant 00.00")] {
        let mut asked = server.request(
            reqwest::Method::GET,
            &format!("/work/bundles/{}", "0".repeat(64)),
            "nothing",
        );
        if let Some(header) = header {
            asked = asked.header("authorization", header);
        }
        let answer = asked.send().expect("the server answers");
        assert_eq!(answer.status(), 403);
    }

    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let like = Worker::start_with(
        scratch.path(),
        "like",
        &(taking(nats.address(), 1) + runtime),
        &["--labels", "lab 3,rack"],
    );
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(like.log().contains("committed"));
    assert!(!like.log().contains("no longer"), "{}", like.log());
    let troubles = other
        .get("/api/v1/workers", Some(&other.admin_token))
        .json::<Value>();
    let troubles = troubles.expect("the API speaks JSON")["troubles"].to_string();
    assert!(
        troubles.contains("is another server's")
            && troubles.contains("give each its own nats.name"),
        "{troubles}"
    );
    drop(other);
    assert!(!lacks.log().contains("begun"), "{}", lacks.log());
    let told = server.get("/api/v1/workers", Some(&server.admin_token));
    let told: Value = told.json().expect("the API speaks JSON");
    let labels = json!(["lab 3", "rack"]);
    let workers = told["workers"].as_array().expect("workers are a list");
    let like = workers.iter().find(|worker| worker["name"] == "like");
    assert_eq!(
        like.map(|worker| &worker["labels"]),
        Some(&labels),
        "{told:#}"
    );
}

#[test]
fn without_nats_a_server_starts_waits_and_goes_on_once_it_is_there() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (files, link) = (Relay::start(), Relay::start());
    let config = format!(
        "{COMMON}[workers]\nslots = 1\nplay = false\n[nats]\nurl = \"nats://{}\"\nfiles_url = \"http://{}\"\n",
        link.address(),
        files.address()
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    server.wait_for_log("NATS cannot be reached", 1);
    // Whoever watches it is told: nobody would play.
    let not_ready = |word: &str| {
        let health = server.poll("/api/v1/health", &server.admin_token, |told| {
            told["detail"]
                .as_str()
                .is_some_and(|detail| detail.contains(word))
        });
        assert_eq!(health["status"], 503, "{health:#}");
    };
    not_ready("The server cannot reach NATS: nats://");
    let worker = Worker::start(scratch.path(), "worker", &taking(link.address(), 1));
    worker.wait_for_log("NATS cannot be reached", 1);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let nats = Nats::start(&scratch.path().join("nats"));
    link.lead_to(nats.address());
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // One that is paid by the hour goes when there is nothing to do.
    let words = ["--drain-after-idle", "1s"];
    Worker::start_with(scratch.path(), "idle", &taking(link.address(), 1), &words).ends();
    let workers = server.poll("/api/v1/workers", &server.admin_token, |told| {
        told["troubles"] == json!([])
    });
    let names = [0, 1].map(|index: usize| workers["workers"][index]["name"].clone());
    assert_eq!(names, ["idle", "worker"], "{workers:#}");
    let _ = server.poll("/api/v1/health", &server.admin_token, |told| {
        told["status"] == "ok"
    });
}

/// A key for NATS: its public half; the secret one is in the file.
fn key(file: &Path) -> String {
    let made = Command::new(program("faceoff"))
        .args(["worker", "--make-key"])
        .arg(file)
        .output()
        .expect("the program can be started");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let key = String::from_utf8(made.stdout).expect("a key is text");
    key.trim().to_owned()
}

#[test]
fn by_the_shipped_permissions_a_worker_works_and_may_do_nothing_else() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let [of_server, of_worker, of_stranger] =
        ["server.nk", "rack-1.nk", "stranger.nk"].map(|name| scratch.path().join(name));
    let shipped = fs::read_to_string(repository().join("docker/nats/nats-server.conf"))
        .expect("it is shipped");
    // Port and folder are the test's.
    let config = shipped
        .replace("listen: \"0.0.0.0:4222\"", "")
        .replace("store_dir: \"/var/lib/nats\"", "")
        .replace("KEY_OF_THE_SERVER", &key(&of_server))
        .replace("KEY_OF_RACK_1", &key(&of_worker));
    let nats = Nats::configured(&scratch.path().join("nats"), &config);
    let files = Relay::start();
    let by = |config: String, key: &Path| format!("{config}nkey_file = \"{}\"\n", key.display());
    let config = by(giving(&nats, files.address()), &of_server);
    let server = Server::start(&scratch.path().join("data"), &config);
    files.lead_to(server.address().into());
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let worker =
        |name, key: &Path| Worker::start(scratch.path(), name, &by(taking(nats.address(), 1), key));
    let _ = key(&of_stranger);
    let stranger = worker("stranger", &of_stranger);
    stranger.wait_for_log("authorization violation", 1);
    let rack = worker("rack-1", &of_worker);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(rack.log().contains("committed"));
    assert!(!stranger.log().contains("begun"), "{}", stranger.log());
    drop(rack);

    // With the worker's own key, what is somebody else's is refused.
    let seed = fs::read_to_string(&of_worker).expect("it was written");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime starts");
    runtime.block_on(async {
        let (tell, told) = mpsc::channel();
        let client = ConnectOptions::with_nkey(seed.trim().to_owned())
            .event_callback(move |event| {
                let tell = tell.clone();
                async move {
                    if let Event::ServerError(error) = event {
                        // The test may be over.
                        let _ = tell.send(error.to_string());
                    }
                }
            })
            .connect(nats.url())
            .await
            .expect("it is known");
        let forbidden = [
            "faceoff.asks.rack-2",
            "faceoff.outcomes.rack-2",
            "faceoff.orders",
            "$JS.API.STREAM.INFO.faceoff-orders",
            "$JS.API.STREAM.MSG.GET.faceoff-orders",
            "$JS.API.CONSUMER.MSG.NEXT.faceoff-outcomes.server",
        ];
        for subject in forbidden {
            client
                .publish(subject, "".into())
                .await
                .expect("it is sent");
            client.flush().await.expect("it is sent");
            let refused = told.recv().expect("NATS answers");
            assert!(
                refused
                    .to_lowercase()
                    .contains("permissions violation for publish"),
                "{refused}"
            );
            assert!(refused.contains(subject), "{refused}");
        }
        for subject in [">", "faceoff.>", "_INBOX.>", "faceoff.shows.rack-1"] {
            let _subscribed = client.subscribe(subject).await.expect("it is sent");
            client.flush().await.expect("it is sent");
            let refused = told.recv().expect("NATS answers");
            assert!(
                refused
                    .to_lowercase()
                    .contains("permissions violation for subscription"),
                "{refused}"
            );
        }
    });
}
