//! Tests of low disk space: the server refuses uploads and warns; requests that need little space still work.

use crate::site::*;
use faceoff_store::FreeSpace;

/// Restarts the server with this minimum of free space.
async fn set_min_free_space(site: &mut Site, min_free_bytes: u64) {
    let free_space = FreeSpace::new(vec![site.folder.path().to_owned()], min_free_bytes);
    site.store = site.store.clone().with_free_space(free_space);
    site.restart().await;
}

fn bundle() -> Vec<u8> {
    [&GZIP[..], &[0; 1000]].concat()
}

#[tokio::test]
async fn low_disk_space_refuses_uploads_and_is_shown() {
    let mut site = Site::start().await;
    let team = site.team("Alpha").await;
    set_min_free_space(&mut site, u64::MAX).await;

    let refused = site.upload(&team.token, bundle()).await;
    refused.problem(507, "storage-full", &["too little free space", "try again"]);
    assert!(refused.headers.contains_key("retry-after"));
    let refused = site.get("/api/v1/season/archive", Some(ADMIN)).await;
    refused.problem(507, "storage-full", &["too little free space"]);
    let uploads = site.folder.path().join("uploads");
    assert_eq!(std::fs::read_dir(uploads).unwrap().count(), 0);
    let submissions = site.get("/api/v1/submissions", Some(&team.token)).await;
    assert_eq!(submissions.json(200), serde_json::json!([]));

    let health = site.get("/api/v1/health", None).await;
    let health = health.problem(503, "not-ready", &["bytes are free"]);
    assert_eq!(health["free_space"], "short");
    assert_eq!(health["queue"], "paused");
    assert_eq!(health["database"], "writable");
    site.get("/api/v1/health/live", None).await.json(200);
    for path in ["/", "/season", "/tasks/hit"] {
        let page = site.get(path, None).await;
        assert_eq!(page.status, 200);
        assert!(page.body.contains("almost full"), "{path}");
    }
    // Requests that need little space still work.
    site.team("Beta").await;

    set_min_free_space(&mut site, 1).await;
    site.upload(&team.token, bundle()).await.json(201);
    let health = site.get("/api/v1/health", None).await.json(200);
    assert_eq!(health["waiting"], 1);
    let page = site.get("/", None).await;
    assert!(!page.body.contains("almost full"));
}
