//! Tests of which requests and streams are refused when the server has no place for all: visitors' first, organisers' last.

use crate::{site::*, sse::Stream, unread_bodies::Connection};
use faceoff_http::HttpLimits;
use reqwest::Method;
use serde_json::{Value, json};

/// Begins a request whose body does not come. Once this returns the request is in flight, until the connection is dropped.
async fn hold_place(site: &Site, path: &str, token: Option<&str>) -> Connection {
    let mut connection = Connection::open(site).await;
    let authorization = token.map(|token| format!("Authorization: Bearer {token}"));
    let mut headers = vec![
        "Content-Type: application/json",
        "Content-Length: 1000",
        "Expect: 100-continue",
    ];
    headers.extend(authorization.as_deref());
    connection
        .send_head(&format!("POST {path}"), &headers)
        .await;
    // The server sends this when a handler begins to read the body.
    let answer = connection.read_head().await;
    assert_eq!(answer, "HTTP/1.1 100 Continue\r\n\r\n");
    connection
}

#[tokio::test]
async fn visitors_leave_places_to_teams_and_organisers() {
    let limits = HttpLimits {
        requests: 8,
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let team = site.team("Alpha").await;
    let tokens = [None, Some(team.token.as_str()), Some(ADMIN)];
    let statuses = async || {
        let mut statuses = Vec::new();
        for token in tokens {
            let answer = site.get("/api/v1/season", token).await;
            statuses.push(answer.status.as_u16());
        }
        statuses
    };
    // The first request with a token makes it known.
    assert_eq!(statuses().await, [200, 200, 200]);

    let mut held = Vec::new();
    for _ in 0..6 {
        held.push(hold_place(&site, "/api/v1/sessions", None).await);
    }
    assert_eq!(statuses().await, [503, 200, 200]);
    // A token that is not valid gives no place, nor does the team's after it was revoked.
    let unknown = site.get("/api/v1/me", Some("fo_team_unknown")).await;
    unknown.problem(503, "busy", &["in flight"]);
    held.push(hold_place(&site, "/api/v1/questions", tokens[1]).await);
    assert_eq!(statuses().await, [503, 503, 200]);
    // A change by an organiser still finds a place.
    let announcement = json!({ "title": "The server is full", "text": "Visitors wait." });
    site.post("/api/v1/announcements", Some(ADMIN), &announcement)
        .await
        .json(201);
    held.push(hold_place(&site, "/api/v1/announcements", tokens[2]).await);
    assert_eq!(statuses().await, [503, 503, 503]);

    drop(held);
    // The server notices the closed connections a moment later.
    while statuses().await != [200, 200, 200] {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn revoked_token_has_the_places_of_visitors() {
    let limits = HttpLimits {
        requests: 4,
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let team = site.team("Alpha").await;
    let invitation = json!({ "role": "member", "team": team.id, "note": "Ada" });
    let invitation = site
        .post("/api/v1/invitations", Some(ADMIN), &invitation)
        .await
        .json(201);
    let join = json!({ "code": invitation["code"], "name": "Ada" });
    let ada = site
        .post("/api/v1/invitations/accept", None, &join)
        .await
        .json(201);
    let ada = &string(&ada["secret"]);
    let made = json!({ "name": "robot" });
    let made = site.post("/api/v1/tokens", Some(ada), &made).await;
    let made = made.json(201);
    let robot = &string(&made["secret"]);
    site.get("/api/v1/whoami", Some(robot)).await.json(200);
    let held = [
        hold_place(&site, "/api/v1/sessions", None).await,
        hold_place(&site, "/api/v1/sessions", None).await,
        hold_place(&site, "/api/v1/sessions", None).await,
    ];
    site.get("/api/v1/whoami", Some(robot)).await.json(200);
    let path = format!("/api/v1/tokens/{}", string(&made["id"]));
    let revoked = site
        .send(Method::DELETE, &path, Some(ada), &Value::Null)
        .await;
    assert!(revoked.status.is_success(), "{revoked:?}");
    // The first request finds out that the token is not valid any more.
    let refused = site.get("/api/v1/whoami", Some(robot)).await;
    refused.problem(401, "unauthenticated", &["revoked"]);
    let refused = site.get("/api/v1/whoami", Some(robot)).await;
    refused.problem(503, "busy", &[]);
    drop(held);
}

#[tokio::test]
async fn last_streams_are_kept_for_teams_and_organisers() {
    let limits = HttpLimits {
        event_readers: 8,
        ..generous_limits()
    };
    let site = Site::start_with(limits).await;
    let team = site.team("Alpha").await;
    let path = "/api/v1/events/stream";
    let mut open = Vec::new();
    for (token, streams) in [(None, 6), (Some(team.token.as_str()), 1), (Some(ADMIN), 1)] {
        for _ in 0..streams {
            let mut stream = Stream::open(&site, path, token, None).await;
            assert_eq!(stream.next().await.unwrap().name, "now");
            open.push(stream);
        }
        let refused = site.get(path, token).await;
        let taken = format!("{} of the 8 places", open.len());
        refused.problem(503, "busy", &[&taken, "the event stream"]);
    }
}
