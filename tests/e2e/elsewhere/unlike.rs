//! A worker that is not like its server, and a second server.

use super::{giving, taking};
use crate::Team;
use faceoff_tests::{
    nats::Nats, program, relay::Relay, repository, server::Server, worker::Worker,
};
use serde_json::{Value, json};
use std::{fs, process::Command};

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
