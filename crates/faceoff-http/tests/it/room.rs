//! Too little room: what is refused, what is told, and what goes on.

use crate::site::*;
use faceoff_store::Room;

/// From now on the disk has less than it must have, or enough again.
async fn set_room(site: &mut Site, min_free_bytes: u64) {
    let room = Room::new(vec![site.folder.path().to_owned()], min_free_bytes);
    site.store = site.store.clone().with_room(room);
    site.restart().await;
}

fn archive() -> Vec<u8> {
    [&GZIP[..], &[0; 1000]].concat()
}

#[tokio::test]
async fn uploads_wait_for_room_and_everybody_is_told() {
    let mut site = Site::start().await;
    let team = site.team("Alpha").await;
    set_room(&mut site, u64::MAX).await;

    let refused = site.upload(&team.token, archive()).await;
    refused.problem(507, "storage-full", &["too little room", "try again"]);
    assert!(refused.headers.contains_key("retry-after"));
    let refused = site.get("/api/v1/season/archive", Some(ADMIN)).await;
    refused.problem(507, "storage-full", &["too little room"]);
    let uploads = site.folder.path().join("uploads");
    assert_eq!(std::fs::read_dir(uploads).unwrap().count(), 0);
    let own = site.get("/api/v1/submissions", Some(&team.token)).await;
    assert_eq!(own.json(200), serde_json::json!([]));

    let health = site.get("/api/v1/health", None).await;
    let health = health.problem(503, "not-ready", &["bytes are free"]);
    assert_eq!(health["room"], "short");
    assert_eq!(health["queue"], "paused");
    assert_eq!(health["database"], "writable");
    site.get("/api/v1/health/live", None).await.json(200);
    for path in ["/", "/season", "/tasks/hit"] {
        let page = site.get(path, None).await;
        assert_eq!(page.status, 200);
        assert!(page.body.contains("too little room"), "{path}");
    }
    // what needs next to nothing is done
    site.team("Beta").await;

    set_room(&mut site, 1).await;
    site.upload(&team.token, archive()).await.json(201);
    let health = site.get("/api/v1/health", None).await.json(200);
    assert_eq!(health["waiting"], 1);
    let page = site.get("/", None).await;
    assert!(!page.body.contains("too little room"));
}
