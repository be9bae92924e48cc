//! Tests of uploads in parts, which can go on after an interruption, and of uploads that are sent again with the same idempotency key.

use crate::site::{Answer, GZIP, MAX_BUNDLE_BYTES, Site, TestTeam, string};
use bytes::Bytes;
use futures::{StreamExt as _, stream};
use reqwest::{Body, Method};
use serde_json::{Value, json};
use std::{
    fs,
    path::PathBuf,
    time::{Duration, SystemTime},
};

/// A bundle of a team that is sent in parts.
struct Parts<'a> {
    site: &'a Site,
    token: String,
    bundle: Vec<u8>,
    /// BLAKE3 hash of the bundle, which identifies the upload.
    hash: String,
}

impl<'a> Parts<'a> {
    /// A bundle of 10,000 bytes, all but the first of which are `filler`.
    fn new(site: &'a Site, team: &TestTeam, filler: u8) -> Self {
        let mut bundle = vec![filler; 10_000];
        bundle[..4].copy_from_slice(&GZIP);
        Self {
            site,
            token: team.token.clone(),
            hash: blake3::hash(&bundle).to_string(),
            bundle,
        }
    }

    fn path(&self) -> String {
        format!("/api/v1/uploads/{}", self.hash)
    }

    /// A request, without a body yet, that sends the bytes from `offset` on.
    fn request(&self, offset: usize) -> reqwest::RequestBuilder {
        self.site
            .request(Method::PATCH, &self.path(), Some(&self.token))
            .header("upload-offset", offset)
            .header("upload-length", self.bundle.len())
    }

    /// Sends the bytes from `offset` to `end` as a part.
    async fn send(&self, offset: usize, end: usize) -> Answer {
        let body = Bytes::copy_from_slice(&self.bundle[offset..end]);
        Answer::read(self.request(offset).body(body).send().await.unwrap()).await
    }

    /// The server's answer to how much has arrived.
    async fn state(&self) -> Answer {
        self.site.get(&self.path(), Some(&self.token)).await
    }

    async fn received_bytes(&self) -> Value {
        self.state().await.json(200)["received_bytes"].clone()
    }

    /// Makes a submission of the parts.
    async fn submit(&self, key: &str) -> Answer {
        let path = format!(
            "/api/v1/submissions?upload={}&file_name=a.tar.gz",
            self.hash
        );
        let request = self.site.request(Method::POST, &path, Some(&self.token));
        let request = request.header("idempotency-key", key);
        Answer::read(request.send().await.unwrap()).await
    }

    /// The files of partial uploads on the server's disk.
    fn files(&self) -> Vec<PathBuf> {
        let folder = self.site.folder.path().join("uploads/partial");
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    }
}

/// The number of the team's submissions.
async fn submissions(site: &Site, team: &TestTeam) -> usize {
    let list = site.get("/api/v1/submissions", Some(&team.token)).await;
    list.json(200).as_array().unwrap().len()
}

#[tokio::test]
async fn parts_become_one_submission() {
    let mut site = Site::start().await;
    let team = site.team("Alpha").await;
    let parts = Parts::new(&site, &team, 7);
    parts.state().await.problem(404, "not-found", &["no part"]);
    let answer = parts.send(0, 4000).await.json(200);
    assert_eq!(
        answer,
        json!({ "blake3": parts.hash, "received_bytes": 4000 })
    );
    let refusal = parts.send(3000, 5000).await;
    let problem = refusal.problem(409, "conflict", &["Upload-Offset", "4000", "3000"]);
    assert_eq!(problem["received_bytes"], 4000);
    let early = parts.submit("key").await;
    early.problem(409, "conflict", &["4000 bytes", "send the missing ones"]);
    let other = site.team("Beta").await;
    let for_other_team = site.get(&parts.path(), Some(&other.token)).await;
    for_other_team.problem(404, "not-found", &[]);

    // A restart of the server keeps what has arrived.
    let (token, bundle, hash) = (parts.token, parts.bundle, parts.hash);
    site.restart().await;
    let parts = Parts {
        site: &site,
        token,
        bundle,
        hash,
    };
    assert_eq!(parts.received_bytes().await, 4000);
    parts.send(4000, 10_000).await.json(200);
    let created = parts.submit("key").await;
    let submission = created.json(201);
    assert_eq!(
        (&submission["blake3"], &submission["bytes"]),
        (&json!(parts.hash), &json!(10_000))
    );
    assert_eq!(submission["file_name"], "a.tar.gz");
    assert!(parts.files().is_empty(), "the parts are removed");
    // Sent again, because the answer was lost.
    let again = parts.submit("key").await;
    assert_eq!(again.json(201)["id"], submission["id"]);
    assert_eq!(again.header("location"), created.header("location"));
    // With another key it would be another submission, whose parts are not there.
    let without_parts = parts.submit("other-key").await;
    without_parts.problem(404, "not-found", &["no part"]);
    assert_eq!(submissions(&site, &team).await, 1);
}

#[tokio::test]
async fn interrupted_part_keeps_what_has_arrived() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let parts = Parts::new(&site, &team, 7);
    let chunk = Bytes::copy_from_slice(&parts.bundle[..6000]);
    // The connection stays open without further bytes, as one whose client has disappeared.
    let stalling_body = stream::iter([Ok::<_, std::io::Error>(chunk)]).chain(stream::pending());
    let stalling_body = Body::wrap_stream(stalling_body);
    let stalled = tokio::spawn(parts.request(0).body(stalling_body).send());
    while parts.state().await.status != 200 || parts.received_bytes().await != 6000 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    parts.send(6000, 10_000).await.json(200);
    let superseded = Answer::read(stalled.await.unwrap().unwrap()).await;
    superseded.problem(409, "conflict", &["newer connection"]);
    parts.submit("key").await.json(201);
}

#[tokio::test]
async fn wrong_parts_are_refused_and_can_be_removed() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut parts = Parts::new(&site, &team, 7);
    // The bundle no longer has the hash that the path names.
    parts.bundle[5000] = 8;
    parts.send(0, 10_000).await.json(200);
    parts
        .submit("key")
        .await
        .problem(409, "conflict", &["10000 bytes", "DELETE"]);
    let remove = async || {
        let request = site.request(Method::DELETE, &parts.path(), Some(&team.token));
        Answer::read(request.send().await.unwrap()).await
    };
    assert_eq!(remove().await.status, 204);
    remove().await.problem(404, "not-found", &["no part"]);

    let request = site
        .request(Method::PATCH, &parts.path(), Some(&team.token))
        .header("upload-offset", 0)
        .header("upload-length", 4);
    let answer = Answer::read(request.body("too long").send().await.unwrap()).await;
    answer.problem(400, "invalid-request", &["expected 4 bytes in all"]);
    let request = site.request(Method::PATCH, &parts.path(), Some(&team.token));
    let answer = Answer::read(request.body("x").send().await.unwrap()).await;
    answer.problem(400, "invalid-request", &["upload-length", "nothing"]);
    let request = site
        .request(Method::PATCH, &parts.path(), Some(&team.token))
        .header("upload-offset", 0)
        .header("upload-length", MAX_BUNDLE_BYTES + 1);
    let answer = Answer::read(request.body("x").send().await.unwrap()).await;
    answer.problem(413, "too-large", &["at most 65536 bytes"]);
    let answer = site.get("/api/v1/uploads/zz", Some(&team.token)).await;
    answer.problem(400, "invalid-request", &["64 hexadecimal digits", "zz"]);

    // The first part is refused already, by the first bytes of the bundle.
    let no_archive = Parts {
        bundle: vec![b'x'; 10_000],
        ..Parts::new(&site, &team, 7)
    };
    let answer = no_archive.send(0, 9000).await;
    answer.problem(415, "unsupported-media-type", &["78787878"]);
}

#[tokio::test]
async fn old_partial_uploads_are_removed() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let uploads: Vec<Parts> = (1..=4)
        .map(|filler| Parts::new(&site, &team, filler))
        .collect();
    for (age_s, upload) in uploads.iter().enumerate() {
        upload.send(0, 5000).await.json(200);
        for file in upload.files() {
            // Files get the time of the system's clock, but the season of the test has its own clock.
            let modified = SystemTime::from(site.now()) + Duration::from_secs(age_s as u64);
            if file.to_string_lossy().ends_with(&upload.hash) {
                fs::File::open(&file)
                    .unwrap()
                    .set_modified(modified)
                    .unwrap();
            }
        }
    }
    assert_eq!(
        uploads[3].files().len(),
        2,
        "as many as a team may send at the same time"
    );
    uploads[0].state().await.problem(404, "not-found", &[]);
    assert_eq!(uploads[3].received_bytes().await, 5000);
    // Partial uploads of all teams expire after a day. The next upload in parts removes them.
    site.next_day();
    site.advance(60);
    let other = site.team("Beta").await;
    let parts = Parts::new(&site, &other, 9);
    parts.send(0, 5000).await.json(200);
    assert_eq!(parts.files().len(), 1, "those of other teams have expired");
}

#[tokio::test]
async fn upload_with_the_same_key_creates_one_submission() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let upload = async |team: &TestTeam, key: &str, body: Vec<u8>| {
        let request = site.request(Method::POST, "/api/v1/submissions", Some(&team.token));
        let request = request.header("idempotency-key", key).body(body);
        Answer::read(request.send().await.unwrap()).await
    };
    let first = upload(&team, "a", GZIP.to_vec()).await.json(201);
    for key in ["a", "\"a\""] {
        let again = upload(&team, key, GZIP.to_vec()).await.json(201);
        assert_eq!(again["id"], first["id"], "{key}");
    }
    let other_bundle = [&GZIP[..], b"other"].concat();
    let refusal = upload(&team, "a", other_bundle.clone()).await;
    let id = string(&first["id"]);
    refusal.problem(422, "invalid-content", &["Idempotency-Key", &id]);
    let second = upload(&team, "b", other_bundle).await.json(201);
    assert_ne!(second["id"], first["id"]);
    assert_eq!(submissions(&site, &team).await, 2);
    // Another team may choose the same key.
    let other = site.team("Beta").await;
    let theirs = upload(&other, "a", GZIP.to_vec()).await.json(201);
    assert_ne!(theirs["id"], first["id"]);
    let refusal = upload(&team, "a b", GZIP.to_vec()).await;
    refusal.problem(
        400,
        "invalid-request",
        &["Idempotency-Key", "visible ASCII"],
    );
}
