//! What a stage does not keep any more: the real server has it go by itself, and says so.

use crate::{CONFIG, Team};
use faceoff_tests::{repository, server::Server};
use reqwest::Method;
use serde_json::{Value, json};
use std::{fs, path::Path};

fn change(server: &Server, stage: &str, body: &Value) -> (u16, Value) {
    let request = server.request(Method::PATCH, stage, &server.admin_token);
    let answer = request.json(body).send().expect("the server answers");
    let status = answer.status().as_u16();
    (status, answer.json().expect("the API speaks JSON"))
}

fn has_archive(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).expect("a folder can be read");
    entries
        .map(|entry| entry.expect("a folder can be read").path())
        .any(|path| {
            if path.is_dir() {
                has_archive(&path)
            } else {
                path.extension().is_some_and(|end| end == "zip")
            }
        })
}

#[test]
fn the_server_has_go_what_a_stage_does_not_keep() {
    let folder = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(folder.path(), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let dataset = format!("{evaluation}/dataset");
    assert_eq!(server.get(&dataset, Some(&team.token)).status(), 200);

    let stages = server.poll("/api/v1/stages", &team.token, |_| true);
    let id = stages[0]["id"].as_str().expect("a stage has an id");
    let stage = format!("/api/v1/stages/{id}");
    let soon = jiff::Timestamp::now() + jiff::SignedDuration::from_secs(2);
    let (status, answer) = change(&server, &stage, &json!({ "closes_at": soon }));
    assert_eq!(status, 200, "{answer:#}");
    let closed = server.poll(&stage, &team.token, |stage| stage["phase"] == "closed");
    assert_eq!(closed["retention"], json!({}));
    let mut wanted = json!({ "retention": { "until": soon } });
    let (status, refused) = change(&server, &stage, &wanted);
    assert_eq!(status, 409, "{refused:#}");
    let detail = refused["detail"].as_str().expect("a problem has a detail");
    assert!(detail.contains("1 datasets of 1 teams"), "{detail}");
    wanted["confirm"] = refused["confirm"].clone();
    let (status, answer) = change(&server, &stage, &wanted);
    assert_eq!(status, 200, "{answer:#}");

    // It looks for what is to go at its start.
    server.kill();
    let server = Server::start(folder.path(), CONFIG);
    let after = server.poll(&evaluation, &team.token, |evaluation| {
        evaluation["dataset_removed"].is_object()
    });
    assert_eq!(after["result"], finished["result"], "the result stays");
    assert_eq!(after["dataset"], Value::Null);
    let gone = server.get(&dataset, Some(&team.token));
    assert_eq!(gone.status(), 410);
    assert!(
        has_archive(&folder.path().join("artifacts/datasets")),
        "the file follows a day later"
    );
}
