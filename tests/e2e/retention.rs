//! Retention: a *stage* (a part of the season) has rules for how long the server keeps files. The server automatically removes
//! files after that time, and reports it.

use crate::{CONFIG, Team};
use faceoff_tests::{repository, server::Server};
use reqwest::Method;
use serde_json::{Value, json};
use std::{fs, path::Path};

/// Changes the stage at this API path. Returns the status and body of the response.
fn change_stage(server: &Server, stage_path: &str, body: &Value) -> (u16, Value) {
    let request = server.request(Method::PATCH, stage_path, &server.admin_token);
    let answer = request.json(body).send().expect("the server answers");
    let status = answer.status().as_u16();
    (status, answer.json().expect("the API speaks JSON"))
}

/// Whether a zip archive is anywhere below the folder.
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
fn expired_dataset_is_removed_and_result_stays() {
    let folder = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(folder.path(), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    let dataset = format!("{evaluation}/dataset");
    assert_eq!(server.get(&dataset, Some(&team.token)).status(), 200);

    let stages = server.poll("/api/v1/stages", &team.token, |_| true);
    let id = stages[0]["id"].as_str().expect("a stage has an id");
    let stage_path = format!("/api/v1/stages/{id}");
    let closes_at = jiff::Timestamp::now() + jiff::SignedDuration::from_secs(2);
    let (status, answer) = change_stage(&server, &stage_path, &json!({ "closes_at": closes_at }));
    assert_eq!(status, 200, "{answer:#}");
    let closed = server.poll(&stage_path, &team.token, |stage| stage["phase"] == "closed");
    assert_eq!(closed["retention"], json!({}));
    // The change removes files, so the server demands a confirmation.
    // Files are kept until the stage closes, which is now.
    let mut body = json!({ "retention": { "until": closes_at } });
    let (status, refused) = change_stage(&server, &stage_path, &body);
    assert_eq!(status, 409, "{refused:#}");
    let detail = refused["detail"].as_str().expect("a problem has a detail");
    assert!(detail.contains("1 datasets of 1 teams"), "{detail}");
    body["confirm"] = refused["confirm"].clone();
    let (status, answer) = change_stage(&server, &stage_path, &body);
    assert_eq!(status, 200, "{answer:#}");

    // A server looks for expired files when it starts.
    server.kill();
    let server = Server::start(folder.path(), CONFIG);
    let after = server.poll(&evaluation, &team.token, |evaluation| {
        evaluation["dataset_removed"].is_object()
    });
    assert_eq!(after["result"], finished["result"], "the result stays");
    assert_eq!(after["dataset"], Value::Null);
    let download = server.get(&dataset, Some(&team.token));
    assert_eq!(download.status(), 410);
    assert!(
        has_archive(&folder.path().join("artifacts/datasets")),
        "the server deletes the file a day later"
    );
}
