//! Tests of the probes for monitoring: liveness, readiness and metrics.

use crate::site::*;
use faceoff_http::HttpLimits;
use faceoff_store::FreeSpace;
use reqwest::Method;

/// The value of a metric, by name and labels.
fn metric(text: &str, name: &str) -> f64 {
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    let value = line.unwrap_or_else(|| panic!("{name} is not in\n{text}"));
    value.trim().parse().unwrap()
}

#[tokio::test]
async fn server_that_is_not_ready_is_live() {
    let mut site = Site::start().await;
    assert_eq!(site.get("/livez", None).await.json(200)["status"], "alive");
    assert_eq!(site.get("/readyz", None).await.json(200)["status"], "ok");
    let free_space = FreeSpace::new(vec![site.folder.path().to_owned()], u64::MAX);
    site.store = site.store.clone().with_free_space(free_space);
    site.restart().await;
    let ready = site.get("/readyz", None).await;
    let problem = ready.problem(503, "not-ready", &["bytes are free"]);
    assert_eq!(problem["free_space"], "short");
    site.get("/livez", None).await.json(200);
    site.store.close().await;
    site.advance(1); // The database is checked once a second at most.
    let ready = site.get("/readyz", None).await;
    ready.problem(503, "not-ready", &["the database cannot be written"]);
    site.get("/livez", None).await.json(200);
}

#[tokio::test]
async fn readiness_problem_names_stuck_slot() {
    let site = Site::start().await;
    let slots = site.metrics().slots();
    site.get("/readyz", None).await.json(200);
    slots.set_stuck(vec!["faceoff-slot-1".to_owned()]);
    let ready = site.get("/readyz", None).await;
    ready.problem(503, "not-ready", &["faceoff-slot-1 is stuck"]);
    slots.set_stuck(Vec::new());
    site.get("/readyz", None).await.json(200);
}

#[tokio::test]
async fn server_at_its_limit_is_live() {
    let limits = HttpLimits {
        requests: 0,
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    site.get("/readyz", None).await.problem(503, "busy", &[]);
    site.get("/livez", None).await.json(200);
}

#[tokio::test]
async fn metrics_are_for_organisers_only() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.get("/metrics", None)
        .await
        .problem(401, "unauthenticated", &[]);
    site.get("/metrics", Some(&team.token))
        .await
        .problem(403, "forbidden", &[]);
    let text = site.get("/metrics", Some(ADMIN)).await;
    assert_eq!(text.status, 200);
    assert!(
        text.header("content-type")
            .starts_with("text/plain; version=0.0.4")
    );
    assert!(text.body.contains("# TYPE faceoff_build_info gauge\n"));
    let open_metrics = site
        .request(Method::GET, "/metrics", Some(ADMIN))
        .header("accept", "application/openmetrics-text;version=1.0.0");
    let open_metrics = Answer::read(open_metrics.send().await.unwrap()).await;
    assert!(
        open_metrics
            .header("content-type")
            .starts_with("application/openmetrics-text")
    );
    assert!(open_metrics.body.ends_with("# EOF\n"));
}

#[tokio::test]
async fn metrics_follow_events() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let metrics = async || site.get("/metrics", Some(ADMIN)).await.body;
    let before = metrics().await;
    assert_eq!(metric(&before, "faceoff_evaluations_open"), 0.0);
    assert_eq!(metric(&before, "faceoff_slots"), 2.0);
    assert_eq!(metric(&before, "faceoff_database_writable"), 1.0);
    assert!(
        metric(
            &before,
            "faceoff_http_requests_total{method=\"POST\",route=\"/api/v1/teams\",status=\"201\"}"
        ) >= 1.0
    );

    assert_eq!(metric(&before, "faceoff_queue_expected_seconds"), 0.0);
    let submission = site.valid_submission(&team, "striker").await;
    site.start_evaluation(&team, &submission).await;
    site.advance(90);
    let during = metrics().await;
    // No shard has run before, so the expected duration of the queue is unknown.
    assert!(metric(&during, "faceoff_queue_expected_seconds").is_nan());
    assert_eq!(metric(&during, "faceoff_remote_long_units"), 0.0);
    assert_eq!(metric(&during, "faceoff_evaluations_open"), 1.0);
    let waiting = "faceoff_queue_units{state=\"waiting\"}";
    assert!(metric(&during, waiting) >= 1.0);
    assert_eq!(metric(&during, "faceoff_queue_oldest_wait_seconds"), 90.0);
    assert_eq!(metric(&during, "faceoff_queue_paused"), 0.0);
    let request = serde_json::json!({ "reason": "a test" });
    site.post("/api/v1/queue/pause", Some(ADMIN), &request)
        .await;
    assert_eq!(metric(&metrics().await, "faceoff_queue_paused"), 1.0);
    // The metrics contain no names and no ids.
    let after = metrics().await;
    for private in ["Alpha", team.id.as_str()] {
        assert!(!after.contains(private), "{private} is in\n{after}");
    }
}
