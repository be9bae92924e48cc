//! What one team's uploads may take.

use crate::site::{Answer, GZIP, Site, TestTeam, patient, text};
use bytes::Bytes;
use faceoff_http::HttpLimits;
use faceoff_store::UploadQuota;
use faceoff_types::SmokeOutcome;
use reqwest::{Body, Method};
use serde_json::json;
use std::{convert::Infallible, time::Duration};
use tokio::{sync::mpsc, task::JoinHandle};

fn bundle(bytes: usize) -> Vec<u8> {
    let mut bundle = GZIP.to_vec();
    bundle.resize(bytes, 7);
    bundle
}

/// An upload that goes on until its sender is dropped.
struct Hanging {
    sender: mpsc::Sender<()>,
    sent: JoinHandle<Answer>,
}

impl Hanging {
    fn begin(site: &Site, team: &TestTeam) -> Self {
        let (sender, mut over) = mpsc::channel::<()>(1);
        let first = futures::stream::iter([Ok::<_, Infallible>(Bytes::from_static(&GZIP))]);
        let rest = futures::stream::once(async move {
            over.recv().await;
            Ok(Bytes::from_static(&[7; 100]))
        });
        let body = Body::wrap_stream(futures::StreamExt::chain(first, rest));
        let request = site
            .request(Method::POST, "/api/v1/submissions", Some(&team.token))
            .body(body);
        let sent = tokio::spawn(async { Answer::of(request.send().await.unwrap()).await });
        Self { sender, sent }
    }

    async fn end(self) -> Answer {
        drop(self.sender);
        self.sent.await.unwrap()
    }
}

/// Waits until so many uploads are on disk, under way.
async fn under_way(site: &Site, uploads: usize) {
    let folder = site.folder.path().join("uploads");
    while std::fs::read_dir(&folder).unwrap().count() != uploads {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test]
async fn one_teams_uploads_take_no_other_teams_place() {
    let site = Site::start_with(HttpLimits {
        team_uploads: 2,
        ..patient()
    })
    .await;
    let (busy, other) = (site.team("Busy").await, site.team("Other").await);
    let hanging = [Hanging::begin(&site, &busy), Hanging::begin(&site, &busy)];
    under_way(&site, 2).await;
    let third = site.upload(&busy.token, bundle(100)).await;
    let problem = third.problem(429, "too-many-uploads", &["2 uploads of your team"]);
    assert_eq!(problem["limit"], 2);
    assert_eq!(third.header("retry-after"), "10");
    site.upload(&other.token, bundle(100)).await.json(201);
    for upload in hanging {
        upload.end().await.json(201);
    }
    site.upload(&busy.token, bundle(100)).await.json(201);
}

#[tokio::test]
async fn an_upload_that_breaks_off_leaves_nothing_and_frees_its_place() {
    let site = Site::start_with(HttpLimits {
        team_uploads: 1,
        ..patient()
    })
    .await;
    let team = site.team("Alpha").await;
    let broken = Hanging::begin(&site, &team);
    under_way(&site, 1).await;
    broken.sent.abort();
    under_way(&site, 0).await;
    site.upload(&team.token, bundle(100)).await.json(201);
}

fn with_quota(day_bytes: u64, stored_bytes: u64) -> HttpLimits {
    HttpLimits {
        upload_quota: UploadQuota {
            day_bytes,
            stored_bytes,
        },
        ..patient()
    }
}

#[tokio::test]
async fn a_days_quota_is_told_in_numbers_and_begins_anew_at_midnight() {
    let site = Site::start_with(with_quota(10_000, 1 << 30)).await;
    let team = site.team("Alpha").await;
    site.upload(&team.token, bundle(6000)).await.json(201);
    let words = ["at most 10000 bytes", "uploaded 6000 today", "6000 or more"];
    let spent = site.upload(&team.token, bundle(6000)).await;
    let problem = spent.problem(429, "day-quota-spent", &words);
    assert_eq!(problem["limit_bytes"], 10_000);
    assert_eq!(problem["used_bytes"], 6000);
    // It is ten o'clock.
    assert_eq!(spent.header("retry-after"), (14 * 3600).to_string());
    // Not announced, it is found while it comes.
    let pieces: Vec<_> = bundle(6000)
        .chunks(1000)
        .map(|piece| Ok::<_, Infallible>(Bytes::copy_from_slice(piece)))
        .collect();
    let body = Body::wrap_stream(futures::stream::iter(pieces));
    let spent = site.upload(&team.token, body).await;
    spent.problem(429, "day-quota-spent", &["4001 or more"]);
    site.upload(&team.token, bundle(4000)).await.json(201);
    // What is larger than any bundle may be is that.
    let large = site.upload(&team.token, bundle(100_000)).await;
    large.problem(429, "day-quota-spent", &[]);
    site.next_day();
    site.upload(&team.token, bundle(6000)).await.json(201);
}

#[tokio::test]
async fn a_refused_bundle_gives_its_room_back() {
    let site = Site::start_with(with_quota(1 << 30, 10_000)).await;
    let team = site.team("Alpha").await;
    let submission = site.upload(&team.token, bundle(6000)).await.json(201);
    let full = site.upload(&team.token, bundle(6000)).await;
    let problem = full.problem(409, "stored-quota-spent", &["6000 are kept of yours"]);
    assert_eq!(problem["limit_bytes"], 10_000);
    site.smoke(SmokeOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "there is no agent.toml".into(),
        timing: Vec::new(),
        log: String::new(),
    })
    .await;
    let now = site.now();
    assert_eq!(site.store.remove_refused_bundles(now).await.unwrap(), 1);
    site.upload(&team.token, bundle(6000)).await.json(201);
    let path = format!("/api/v1/submissions/{}", text(&submission["id"]));
    let told = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(told["reason"], json!("there is no agent.toml"));
}
