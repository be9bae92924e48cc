//! Workers that lack a *runtime* (an environment for agents, such as an interpreter) of their server, and a second server that uses
//! the same streams of the message broker NATS.

use super::{server_config, worker_config};
use crate::Team;
use faceoff_tests::{
    nats::Nats, program, relay::Relay, repository, server::Server, worker::Worker,
};
use serde_json::{Value, json};
use std::{fs, process::Command};

#[test]
fn worker_without_required_runtime_gets_no_jobs() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let nats = Nats::start(&scratch.path().join("nats"));
    let file_relay = Relay::start();
    let runtime_config = "[runtimes.other]\nread_only_paths = [\"/usr/lib\", \"/lib\", \"/lib64\"]\npath = \"/usr/bin\"\n";
    let config = server_config(&nats, file_relay.address()) + runtime_config;
    let server = Server::start(&scratch.path().join("data"), &config);
    file_relay.set_target(server.address().into());
    let incompatible = Worker::start(
        scratch.path(),
        "incompatible",
        &worker_config(nats.address(), 1),
    );
    incompatible.wait_for_log("lacks runtimes that the server offers to agents: other", 1);
    // `doctor` reports the same before a worker is started.
    for (runtimes_config, expected) in [
        ("", "would give no jobs"),
        (runtime_config, "would give jobs to a worker \"candidate\""),
    ] {
        let file = scratch.path().join("candidate.toml");
        fs::write(&file, worker_config(nats.address(), 1) + runtimes_config)
            .expect("a file can be written");
        let doctor = Command::new(program("faceoff"))
            .args(["doctor", "--name", "candidate", "--config"])
            .arg(&file)
            .output()
            .expect("the program can be started");
        let output = String::from_utf8_lossy(&doctor.stdout);
        assert!(
            output.contains("nats-server 2.") && output.contains(expected),
            "{output}"
        );
    }
    // Another server on the same streams reports the conflict and answers no worker while the first one runs.
    let second_server = Server::start(&scratch.path().join("second"), &config);
    second_server.wait_for_log("is another server's", 1);

    // A grant is the secret with which a worker gets the files of its job. Clients without a grant get no files.
    for header in [None, Some("Grant 00.00")] {
        let mut request = server.request(
            reqwest::Method::GET,
            &format!("/work/bundles/{}", "0".repeat(64)),
            "no-token",
        );
        if let Some(header) = header {
            request = request.header("authorization", header);
        }
        let answer = request.send().expect("the server answers");
        assert_eq!(answer.status(), 403);
    }

    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let compatible = Worker::start_with_arguments(
        scratch.path(),
        "compatible",
        &(worker_config(nats.address(), 1) + runtime_config),
        &["--labels", "lab 3,rack"],
    );
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    assert!(compatible.log().contains("committed"));
    assert!(
        !compatible.log().contains("lease lost"),
        "{}",
        compatible.log()
    );
    let problems = second_server
        .get("/api/v1/workers", Some(&second_server.admin_token))
        .json::<Value>();
    let problems = problems.expect("the API speaks JSON")["problems"].to_string();
    assert!(
        problems.contains("is another server's")
            && problems.contains("give each server its own nats.name"),
        "{problems}"
    );
    drop(second_server);
    assert!(
        !incompatible.log().contains("started job="),
        "{}",
        incompatible.log()
    );
    let view = server.get("/api/v1/workers", Some(&server.admin_token));
    let view: Value = view.json().expect("the API speaks JSON");
    let labels = json!(["lab 3", "rack"]);
    let workers = view["workers"].as_array().expect("workers are a list");
    let compatible = workers.iter().find(|worker| worker["name"] == "compatible");
    assert_eq!(
        compatible.map(|worker| &worker["labels"]),
        Some(&labels),
        "{view:#}"
    );
}
