//! Tests of the limits of one team's uploads: concurrent uploads, daily quota and storage quota.

use crate::site::{Answer, GZIP, Site, TestTeam, generous_limits, invalid_outcome, string};
use bytes::Bytes;
use faceoff_http::HttpLimits;
use faceoff_store::UploadQuota;
use reqwest::{Body, Method};
use serde_json::json;
use std::{convert::Infallible, time::Duration};
use tokio::{sync::mpsc, task::JoinHandle};

/// A bundle of this size.
fn bundle(bytes: usize) -> Vec<u8> {
    let mut bundle = GZIP.to_vec();
    bundle.resize(bytes, 7);
    bundle
}

/// An upload that waits after its first bytes; [`Self::end`] sends the rest.
struct OpenUpload {
    sender: mpsc::Sender<()>,
    answer: JoinHandle<Answer>,
}

impl OpenUpload {
    fn begin(site: &Site, team: &TestTeam) -> Self {
        let (sender, mut closed) = mpsc::channel::<()>(1);
        let first = futures::stream::iter([Ok::<_, Infallible>(Bytes::from_static(&GZIP))]);
        let rest = futures::stream::once(async move {
            closed.recv().await;
            Ok(Bytes::from_static(&[7; 100]))
        });
        let body = Body::wrap_stream(futures::StreamExt::chain(first, rest));
        let request = site
            .request(Method::POST, "/api/v1/submissions", Some(&team.token))
            .body(body);
        let answer = tokio::spawn(async { Answer::read(request.send().await.unwrap()).await });
        Self { sender, answer }
    }

    async fn end(self) -> Answer {
        drop(self.sender);
        self.answer.await.unwrap()
    }
}

/// Waits until exactly this number of uploads has a temporary file.
async fn wait_for_uploads(site: &Site, uploads: usize) {
    let folder = site.folder.path().join("uploads");
    while std::fs::read_dir(&folder).unwrap().count() != uploads {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test]
async fn concurrent_uploads_are_limited_per_team() {
    let site = Site::start_with(HttpLimits {
        team_uploads: 2,
        ..generous_limits()
    })
    .await;
    let (busy, other) = (site.team("Busy").await, site.team("Other").await);
    let open_uploads = [
        OpenUpload::begin(&site, &busy),
        OpenUpload::begin(&site, &busy),
    ];
    wait_for_uploads(&site, 2).await;
    let third = site.upload(&busy.token, bundle(100)).await;
    let problem = third.problem(429, "too-many-uploads", &["2 uploads of your team"]);
    assert_eq!(problem["limit"], 2);
    assert_eq!(third.header("retry-after"), "10");
    site.upload(&other.token, bundle(100)).await.json(201);
    for upload in open_uploads {
        upload.end().await.json(201);
    }
    site.upload(&busy.token, bundle(100)).await.json(201);
}

#[tokio::test]
async fn interrupted_upload_leaves_no_file_and_is_not_counted() {
    let site = Site::start_with(HttpLimits {
        team_uploads: 1,
        ..generous_limits()
    })
    .await;
    let team = site.team("Alpha").await;
    let broken = OpenUpload::begin(&site, &team);
    wait_for_uploads(&site, 1).await;
    broken.answer.abort();
    wait_for_uploads(&site, 0).await;
    site.upload(&team.token, bundle(100)).await.json(201);
}

fn with_quota(day_bytes: u64, stored_bytes: u64) -> HttpLimits {
    HttpLimits {
        upload_quota: UploadQuota {
            day_bytes,
            stored_bytes,
        },
        ..generous_limits()
    }
}

#[tokio::test]
async fn daily_quota_is_reported_and_resets_at_midnight() {
    let site = Site::start_with(with_quota(10_000, 1 << 30)).await;
    let team = site.team("Alpha").await;
    site.upload(&team.token, bundle(6000)).await.json(201);
    let words = ["at most 10000 bytes", "uploaded 6000 today", "6000 or more"];
    let refused = site.upload(&team.token, bundle(6000)).await;
    let problem = refused.problem(429, "day-quota-spent", &words);
    assert_eq!(problem["limit_bytes"], 10_000);
    assert_eq!(problem["used_bytes"], 6000);
    // It is ten o'clock, so midnight is in 14 hours.
    assert_eq!(refused.header("retry-after"), (14 * 3600).to_string());
    // Without a Content-Length the limit is found during the upload.
    let pieces: Vec<_> = bundle(6000)
        .chunks(1000)
        .map(|piece| Ok::<_, Infallible>(Bytes::copy_from_slice(piece)))
        .collect();
    let body = Body::wrap_stream(futures::stream::iter(pieces));
    let refused = site.upload(&team.token, body).await;
    refused.problem(429, "day-quota-spent", &["4001 or more"]);
    site.upload(&team.token, bundle(4000)).await.json(201);
    // The quota is checked before the maximum size of bundles.
    let large = site.upload(&team.token, bundle(100_000)).await;
    large.problem(429, "day-quota-spent", &[]);
    site.next_day();
    site.upload(&team.token, bundle(6000)).await.json(201);
}

#[tokio::test]
async fn invalid_submission_frees_its_storage_quota() {
    let site = Site::start_with(with_quota(1 << 30, 10_000)).await;
    let team = site.team("Alpha").await;
    let submission = site.upload(&team.token, bundle(6000)).await.json(201);
    let full = site.upload(&team.token, bundle(6000)).await;
    let problem = full.problem(409, "stored-quota-spent", &["yours has stored 6000"]);
    assert_eq!(problem["limit_bytes"], 10_000);
    site.finish_validation(invalid_outcome("there is no agent.toml", ""))
        .await;
    let now = site.now();
    assert_eq!(
        site.store.clean_up_failed_submissions(now).await.unwrap(),
        1
    );
    site.upload(&team.token, bundle(6000)).await.json(201);
    let path = format!("/api/v1/submissions/{}", string(&submission["id"]));
    let view = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(view["reason"], json!("there is no agent.toml"));
}
