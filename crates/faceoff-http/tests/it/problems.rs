//! Tests of errors: problem documents (RFC 9457) for API clients, and pages for browsers.

use crate::site::{ADMIN, Answer, Site, generous_limits};
use faceoff_http::HttpLimits;
use reqwest::Method;
use std::time::Duration;

async fn send(site: &Site, method: Method, path: &str, accept: &str) -> Answer {
    let request = site.request(method, path, None).header("accept", accept);
    Answer::read(request.send().await.unwrap()).await
}

#[tokio::test]
async fn unknown_paths_answer_problems_or_pages() {
    let site = Site::start().await;
    site.get("/api/v1/nothing", None)
        .await
        .problem(404, "not-found", &["/api/v1/nothing"]);
    site.get("/nothing", None)
        .await
        .problem(404, "not-found", &["/nothing"]);
    let api_answer = send(&site, Method::GET, "/api/v1/nothing", "text/html").await;
    api_answer.problem(404, "not-found", &[]);
    let refused = send(&site, Method::DELETE, "/api/v1/teams", "*/*").await;
    refused.problem(405, "method-not-allowed", &["DELETE", "Allow"]);
    assert!(refused.header("allow").contains("POST"));
    send(&site, Method::PUT, "/api/v1/submissions", "*/*")
        .await
        .problem(405, "method-not-allowed", &["PUT"]);

    let page = send(&site, Method::GET, "/nothing<script>", "text/html").await;
    assert_eq!(page.status, 404);
    assert!(page.header("content-type").starts_with("text/html"));
    assert!(page.body.contains("Not found") && !page.body.contains("<script>"));
    for path in [
        "/tasks/juggle",
        "/evaluations/17",
        "/evaluations/01890000-0000-7000-8000-000000000000",
    ] {
        assert_eq!(
            send(&site, Method::GET, path, "text/html").await.status,
            404,
            "{path}"
        );
    }
}

#[tokio::test]
async fn invalid_json_is_refused_with_its_position() {
    let site = Site::start().await;
    let post = |content_type: &'static str, body: String| {
        let request = site
            .request(Method::POST, "/api/v1/teams", Some(ADMIN))
            .header("content-type", content_type)
            .body(body);
        async move { Answer::read(request.send().await.unwrap()).await }
    };
    let json = "application/json";
    post(json, "{\"name\":".into())
        .await
        .problem(400, "invalid-request", &["JSON", "line 1"]);
    post(json, "[1]".into())
        .await
        .problem(422, "invalid-content", &["line 1"]);
    post(json, "{\"name\":7}".into())
        .await
        .problem(422, "invalid-content", &["string"]);
    post(json, String::new())
        .await
        .problem(400, "invalid-request", &["JSON"]);
    post("text/plain", "{\"name\":\"A\"}".into()).await.problem(
        415,
        "unsupported-media-type",
        &["Content-Type: application/json"],
    );
    let large = format!("{{\"name\":\"{}\"}}", "a".repeat(70_000));
    post(json, large)
        .await
        .problem(413, "too-large", &["65536"]);
}

#[tokio::test]
async fn responses_have_a_request_id_and_security_headers() {
    let site = Site::start().await;
    for path in [
        "/",
        "/api/v1/board",
        "/api/v1/nothing",
        "/static/faceoff.css",
    ] {
        let answer = site.get(path, None).await;
        assert_eq!(answer.header("x-request-id").len(), 36, "{path}");
        assert_eq!(answer.header("x-content-type-options"), "nosniff");
        let policy = answer.header("content-security-policy");
        assert!(
            policy.starts_with("default-src 'none'") && !policy.contains("unsafe"),
            "{policy}"
        );
        assert!(
            policy.contains("script-src 'self'; connect-src 'self';"),
            "only scripts of the server may run: {policy}"
        );
    }
    let response = site
        .request(Method::GET, "/", None)
        .header("x-request-id", "forged-id")
        .send()
        .await
        .unwrap();
    assert_ne!(response.headers()["x-request-id"], "forged-id");
}

#[tokio::test]
async fn busy_response_has_retry_after() {
    let site = Site::start_with(HttpLimits {
        requests: 0,
        ..generous_limits()
    })
    .await;
    let busy = site.get("/api/v1/health", None).await;
    busy.problem(503, "busy", &["try again"]);
    assert_eq!(busy.header("retry-after"), "2");

    // The handler waits for a body that never ends.
    let limits = HttpLimits {
        request_timeout: Duration::from_millis(50),
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let endless = futures::stream::pending::<Result<bytes::Bytes, std::io::Error>>();
    let slow = site
        .request(Method::POST, "/api/v1/teams", Some(ADMIN))
        .header("content-type", "application/json")
        .body(reqwest::Body::wrap_stream(endless))
        .send()
        .await
        .unwrap();
    Answer::read(slow)
        .await
        .problem(503, "busy", &["longer than 0.05 s"]);
}

#[tokio::test]
async fn store_failure_is_internal_and_hides_its_cause() {
    let site = Site::start().await;
    site.get("/api/v1/health", None).await.json(200);
    site.store.close().await;
    let broken = site.get("/api/v1/season", None).await;
    broken.problem(500, "internal", &["x-request-id"]);
    site.advance(1); // The database is checked once a second at most.
    let not_ready = site.get("/api/v1/health", None).await;
    not_ready.problem(503, "not-ready", &["the database cannot be written"]);
    for answer in [&broken, &not_ready] {
        assert!(!answer.body.to_lowercase().contains("sql") && !answer.body.contains("pool"));
    }
    site.get("/api/v1/health/live", None).await.json(200);
}

#[tokio::test]
async fn problem_types_are_explained_on_their_page() {
    let site = Site::start().await;
    let page = site.get("/problems", None).await;
    assert_eq!(page.status, 200);
    for kind in faceoff_http::problem::ProblemKind::ALL {
        assert!(
            page.body.contains(&format!("id=\"{}\"", kind.slug())),
            "{}",
            kind.slug()
        );
    }
}
