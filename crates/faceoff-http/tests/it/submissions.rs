//! Tests of uploads, and of the submissions that they become.

use crate::site::{
    ADMIN, Answer, GZIP, MAX_BUNDLE_BYTES, Site, generous_limits, invalid_outcome, string,
};
use bytes::Bytes;
use faceoff_http::{HttpLimits, MinTransferRate};
use faceoff_testkit::valid_outcome;
use faceoff_types::ValidationOutcome;
use reqwest::{Body, Method};
use serde_json::{Value, json};
use std::{convert::Infallible, time::Duration};

/// A bundle of `bytes` bytes, which is sent in pieces of 5000 bytes and without a Content-Length.
fn chunked_bundle(bytes: usize) -> Body {
    let mut bundle = vec![7; bytes];
    bundle[..4].copy_from_slice(&GZIP);
    let pieces: Vec<_> = bundle
        .chunks(5000)
        .map(|piece| Ok::<_, Infallible>(Bytes::copy_from_slice(piece)))
        .collect();
    Body::wrap_stream(futures::stream::iter(pieces))
}

/// The number of files in the folder of uploads that are not complete.
fn temporary_uploads(site: &Site) -> usize {
    std::fs::read_dir(site.folder.path().join("uploads"))
        .unwrap()
        .count()
}

#[tokio::test]
async fn upload_is_stored_hashed_and_queued() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let size = MAX_BUNDLE_BYTES as usize;
    let answer = site.upload(&team.token, chunked_bundle(size)).await;
    let submission = answer.json(201);
    let path = format!("/api/v1/submissions/{}", string(&submission["id"]));
    assert_eq!(answer.header("location"), path);
    assert_eq!(submission["state"], "validating");
    assert_eq!(submission["bytes"], MAX_BUNDLE_BYTES);
    assert_eq!(submission["file_name"], "striker.tar.gz");

    let stored = site
        .store
        .submission(string(&submission["id"]).parse().unwrap())
        .await
        .unwrap();
    let copy = site.folder.path().join("copy");
    site.store
        .artifacts()
        .get_to_file(&stored.bundle.key, &copy)
        .await
        .unwrap();
    let bytes = std::fs::read(&copy).unwrap();
    assert_eq!(bytes.len(), size);
    assert_eq!(
        blake3::hash(&bytes).to_string(),
        string(&submission["blake3"])
    );
    assert_eq!(temporary_uploads(&site), 0);

    let outcome = valid_outcome("native", "striker 1.0", "model loaded\n");
    site.finish_validation(outcome).await;
    let mut submission = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(submission["state"], "valid");
    assert_eq!(submission["agent_name"], "striker 1.0");
    // The log is part of the single view, not of lists.
    let log = submission.as_object_mut().unwrap().remove("log");
    assert_eq!(log, Some(json!("model loaded\n")));
    let list = site
        .get("/api/v1/submissions", Some(&team.token))
        .await
        .json(200);
    assert_eq!(list, json!([submission]));
}

#[tokio::test]
async fn invalid_submission_shows_reason_and_log() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let id = string(&site.upload(&team.token, GZIP.to_vec()).await.json(201)["id"]);
    let outcome = invalid_outcome(
        "no answer within the start-up limit of 120 s",
        "ImportError: torch\n",
    );
    site.finish_validation(outcome).await;
    let path = format!("/api/v1/submissions/{id}");
    let submission = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(submission["state"], "invalid");
    assert_eq!(
        submission["reason"],
        "no answer within the start-up limit of 120 s"
    );
    assert_eq!(submission["log"], "ImportError: torch\n");
    site.post(&format!("{path}/activate"), Some(&team.token), &json!({}))
        .await
        .problem(409, "conflict", &["invalid", "upload"]);
}

#[tokio::test]
async fn newest_valid_submission_is_active_until_another_is_chosen() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let token = Some(team.token.as_str());
    // The path of the only active submission.
    let active = async || {
        let list = site.get("/api/v1/submissions", token).await.json(200);
        let list = list.as_array().unwrap().clone();
        let active: Vec<_> = list
            .iter()
            .filter(|submission| submission["active"] == true)
            .collect();
        let [submission] = active[..] else {
            panic!("expected one active submission: {list:#?}")
        };
        let me = site.get("/api/v1/me", token).await.json(200);
        assert_eq!(me["active_submission"], submission["id"]);
        format!("/api/v1/submissions/{}", string(&submission["id"]))
    };
    let first = site.valid_submission(&team, "first").await;
    assert_eq!(active().await, first);
    site.advance(1);
    let second = string(&site.upload(&team.token, GZIP.to_vec()).await.json(201)["id"]);
    let activate = format!("/api/v1/submissions/{second}/activate");
    site.post(&activate, token, &json!({}))
        .await
        .problem(409, "conflict", &["wait"]);
    assert_eq!(active().await, first);
    let outcome = valid_outcome("native", "second", "");
    site.finish_validation(outcome).await;
    assert!(active().await.ends_with(&second));

    site.advance(1);
    let activated = site
        .post(&format!("{first}/activate"), token, &json!({}))
        .await;
    assert_eq!(activated.json(200)["active"], true);
    assert_eq!(active().await, first);
    let evaluation = site.start_evaluation(&team, &first).await;
    // An activation after the cutoff applies to the next cutoff.
    site.advance(1);
    site.post(&activate, token, &json!({})).await.json(200);
    let running = site.get(&evaluation, token).await.json(200);
    assert!(first.ends_with(&string(&running["submission"])));
    site.advance(1);
    let third = site.valid_submission(&team, "third").await;
    assert_eq!(active().await, third);
    site.post(&format!("{first}/activate"), Some(ADMIN), &json!({}))
        .await
        .problem(403, "forbidden", &[]);
}

/// Texts that earlier versions stored may contain control characters.
#[tokio::test]
async fn agent_texts_are_escaped() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let id = string(&site.upload(&team.token, GZIP.to_vec()).await.json(201)["id"]);
    let outcome = ValidationOutcome::Invalid {
        runtime: None,
        timing: Vec::new(),
        agent_name: Some("a\u{202e}b".into()),
        reason: "expected act, got \u{2066}\u{1b}[2J".into(),
        log: "\u{9b}31m red\n".into(),
    };
    site.finish_validation(outcome).await;
    let path = format!("/api/v1/submissions/{id}");
    let submission = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(submission["agent_name"], "a\\u202eb");
    assert_eq!(submission["reason"], "expected act, got \\u2066\\u001b[2J");
    assert_eq!(submission["log"], "\\u009b31m red\n");
}

#[tokio::test]
async fn too_large_bundle_is_refused_with_and_without_length() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let limit = MAX_BUNDLE_BYTES as usize;
    let mut with_length = vec![7; limit + 1];
    with_length[..4].copy_from_slice(&GZIP);
    let problem = site.upload(&team.token, with_length).await.problem(
        413,
        "too-large",
        &["65536 bytes", "65537", "leave out"],
    );
    assert_eq!(problem["limit_bytes"], MAX_BUNDLE_BYTES);
    for bytes in [limit + 1, 20 * limit] {
        site.upload(&team.token, chunked_bundle(bytes))
            .await
            .problem(413, "too-large", &["65536"]);
    }
    assert_eq!(temporary_uploads(&site), 0);
    assert_eq!(
        site.get("/api/v1/submissions", Some(&team.token))
            .await
            .json(200),
        json!([])
    );
}

#[tokio::test]
async fn upload_that_is_no_archive_is_refused() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let upload = |body: Vec<u8>| site.upload(&team.token, body);
    let slug = "unsupported-media-type";
    upload(b"#!/bin/sh".to_vec())
        .await
        .problem(415, slug, &["23212f62", ".tar.gz"]);
    upload(vec![0x1f]).await.problem(415, slug, &["1f"]);
    upload(vec![])
        .await
        .problem(400, "invalid-request", &["empty"]);

    let form = site
        .request(Method::POST, "/api/v1/submissions", Some(&team.token))
        .header("content-type", "multipart/form-data; boundary=x")
        .body("--x\r\n")
        .send()
        .await
        .unwrap();
    Answer::read(form)
        .await
        .problem(415, slug, &["multipart/form-data", "--data-binary"]);
    site.request(
        Method::POST,
        "/api/v1/submissions?name=x",
        Some(&team.token),
    )
    .body(GZIP.to_vec())
    .send()
    .await
    .map(async |response| {
        Answer::read(response)
            .await
            .problem(400, "invalid-request", &["name"])
    })
    .unwrap()
    .await;
    assert_eq!(temporary_uploads(&site), 0);
}

#[tokio::test]
async fn stalled_upload_times_out() {
    let limits = HttpLimits {
        min_upload_rate: MinTransferRate {
            bytes_per_s: 1000,
            grace: Duration::from_millis(50),
        },
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let team = site.team("Alpha").await;
    use futures::StreamExt;
    let first = futures::stream::iter([Ok::<_, Infallible>(Bytes::from_static(&GZIP))]);
    let body = Body::wrap_stream(first.chain(futures::stream::pending()));
    site.upload(&team.token, body).await.problem(
        408,
        "request-timeout",
        &["send it again", "1000 bytes per second"],
    );
    assert_eq!(temporary_uploads(&site), 0);
}

#[tokio::test]
async fn unvalidated_submissions_of_a_team_are_limited() {
    let limits = HttpLimits {
        pending_submissions: 2,
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let team = site.team("Alpha").await;
    for _ in 0..2 {
        site.upload(&team.token, GZIP.to_vec()).await.json(201);
    }
    let refused = site.upload(&team.token, GZIP.to_vec()).await;
    refused.problem(429, "too-many-pending", &["2 submissions", "verdict"]);
    assert_eq!(refused.header("retry-after"), "30");
    site.finish_validation(valid_outcome("native", "a", ""))
        .await;
    site.upload(&team.token, GZIP.to_vec()).await.json(201);
}

#[tokio::test]
async fn submission_of_another_team_is_not_found() {
    let site = Site::start().await;
    let (owner, other) = (site.team("Owner").await, site.team("Other").await);
    let path = site.valid_submission(&owner, "striker").await;
    let refused = site.get(&path, Some(&other.token)).await;
    let missing = site
        .get(
            "/api/v1/submissions/01890000-0000-7000-8000-000000000000",
            Some(&other.token),
        )
        .await;
    refused.problem(404, "not-found", &["submission"]);
    assert_eq!(refused.body, missing.body);
    site.post(&format!("{path}/activate"), Some(&other.token), &json!({}))
        .await
        .problem(404, "not-found", &[]);
    assert_eq!(
        site.get("/api/v1/submissions", Some(&other.token))
            .await
            .json(200),
        json!([])
    );
    site.get(&path, Some(ADMIN)).await.json(200);
    site.get(&path, None)
        .await
        .problem(401, "unauthenticated", &[]);
    site.get("/api/v1/submissions/seventeen", Some(&owner.token))
        .await
        .problem(404, "not-found", &["seventeen", "UUID"]);
}

#[tokio::test]
async fn team_labels_and_withdraws_its_submission() {
    let site = Site::start().await;
    let (team, other) = (site.team("Alpha").await, site.team("Beta").await);
    let path = site.valid_submission(&team, "a").await;
    let describe = async |token: &str, body: Value| site.patch(&path, Some(token), &body).await;
    let labelled = describe(&team.token, json!({ "label": " baseline " }))
        .await
        .json(200);
    assert_eq!(labelled["label"], "baseline");
    for wrong in [json!(""), json!("x".repeat(81))] {
        let body = json!({ "label": wrong });
        describe(&team.token, body)
            .await
            .problem(422, "invalid-content", &["label", "1 to 80"]);
    }
    describe(&team.token, json!({ "name": "x" })).await.problem(
        422,
        "invalid-content",
        &["name", "label"],
    );
    describe(&team.token, json!({})).await.problem(
        422,
        "invalid-content",
        &["label, note, or both", "got neither"],
    );
    let note = "line one\nline two";
    let with_note = describe(&team.token, json!({ "note": note }))
        .await
        .json(200);
    assert_eq!(
        (&with_note["note"], &with_note["label"]),
        (&json!(note), &json!("baseline"))
    );
    for wrong in [json!(" "), json!("x".repeat(2001))] {
        describe(&team.token, json!({ "note": wrong }))
            .await
            .problem(422, "invalid-content", &["note", "1 to 2000"]);
    }
    let labelled = describe(&team.token, json!({ "label": null }))
        .await
        .json(200);
    assert_eq!(labelled.get("label"), None);
    assert_eq!(labelled["note"], note, "omitted fields do not change");

    let withdraw = format!("{path}/withdraw");
    for (token, status, slug) in [
        (&other.token[..], 404, "not-found"),
        (ADMIN, 403, "forbidden"),
    ] {
        site.post(&withdraw, Some(token), &json!({}))
            .await
            .problem(status, slug, &[]);
        describe(token, json!({ "label": "x" }))
            .await
            .problem(status, slug, &[]);
    }
    let withdrawn = site
        .post(&withdraw, Some(&team.token), &json!({}))
        .await
        .json(200);
    assert_eq!(withdrawn["active"], false);
    assert_eq!(withdrawn["withdrawn_at"], "2026-03-01T10:00:00Z");
    site.post(&withdraw, Some(&team.token), &json!({}))
        .await
        .problem(409, "conflict", &["already"]);
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(me["active_submission"], json!(null));
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "conflict", &["no team has a valid submission"]);
    let active = site
        .post(&format!("{path}/activate"), Some(&team.token), &json!({}))
        .await;
    assert_eq!(active.json(200)["active"], true);
}
