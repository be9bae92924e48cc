//! Tests of the OpenAPI document, and of requests that it does not allow.

use crate::site::{ADMIN, Answer, GZIP, Site};
use flate2::read::GzDecoder;
use reqwest::Method;
use serde_json::{Value, json};
use std::io::Read;

#[tokio::test]
async fn document_is_compressed_and_sent_once_per_client() {
    let site = Site::start().await;
    let get = async |name: &str, value: &str| {
        let request = site.request(Method::GET, "/api/v1/openapi.json", None);
        request.header(name, value).send().await.unwrap()
    };
    let plain = get("accept-encoding", "identity").await;
    assert_eq!(plain.headers().get("content-encoding"), None);
    assert_eq!(plain.headers()["vary"], "accept-encoding");
    let tag = plain.headers()["etag"].to_str().unwrap().to_owned();
    let plain = plain.bytes().await.unwrap();
    let compressed = get("accept-encoding", "gzip").await;
    assert_eq!(compressed.headers()["content-encoding"], "gzip");
    assert_eq!(compressed.headers()["content-type"], "application/json");
    let compressed = compressed.bytes().await.unwrap();
    let mut unpacked = Vec::new();
    GzDecoder::new(&compressed[..])
        .read_to_end(&mut unpacked)
        .unwrap();
    assert!(unpacked == plain, "the document is the same");
    let repeated = get("if-none-match", &tag).await;
    assert_eq!(repeated.status(), 304);
}

#[tokio::test]
async fn document_lists_all_operations() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    assert!(document["openapi"].as_str().unwrap().starts_with("3."));
    let mut listed: Vec<String> = document["paths"]
        .as_object()
        .unwrap()
        .iter()
        .flat_map(|(path, item)| {
            item.as_object()
                .unwrap()
                .keys()
                .map(move |method| format!("{} {path}", method.to_uppercase()))
        })
        .collect();
    listed.sort();
    let expected = [
        "DELETE /api/v1/games/{id}",
        "DELETE /api/v1/invitations/{id}",
        "DELETE /api/v1/sessions/current",
        "DELETE /api/v1/submissions/{id}",
        "DELETE /api/v1/tokens/{id}",
        "DELETE /api/v1/tournaments/{id}/replays",
        "DELETE /api/v1/uploads/{blake3}",
        "DELETE /api/v1/webhooks/{id}",
        "GET /api/v1/announcements",
        "GET /api/v1/board",
        "GET /api/v1/board/history",
        "GET /api/v1/board/{task}",
        "GET /api/v1/evaluations",
        "GET /api/v1/evaluations/{id}",
        "GET /api/v1/evaluations/{id}/compare/{other}",
        "GET /api/v1/evaluations/{id}/dataset",
        "GET /api/v1/evaluations/{id}/episodes",
        "GET /api/v1/evaluations/{id}/episodes/{task}/{episode}/motion",
        "GET /api/v1/evaluations/{id}/episodes/{task}/{episode}/observed",
        "GET /api/v1/evaluations/{id}/violations",
        "GET /api/v1/events",
        "GET /api/v1/events/stream",
        "GET /api/v1/games/{id}",
        "GET /api/v1/games/{id}/attempts",
        "GET /api/v1/games/{id}/live",
        "GET /api/v1/games/{id}/motion/{chunk}",
        "GET /api/v1/games/{id}/recording",
        "GET /api/v1/games/{id}/sides/{side}",
        "GET /api/v1/games/{id}/sides/{side}/log",
        "GET /api/v1/games/{id}/sides/{side}/observed/{chunk}",
        "GET /api/v1/health",
        "GET /api/v1/health/live",
        "GET /api/v1/invitations",
        "GET /api/v1/me",
        "GET /api/v1/people",
        "GET /api/v1/proposals",
        "GET /api/v1/proposals/{id}",
        "GET /api/v1/questions",
        "GET /api/v1/registrations",
        "GET /api/v1/runtimes",
        "GET /api/v1/season",
        "GET /api/v1/season/archive",
        "GET /api/v1/stages",
        "GET /api/v1/stages/{id}",
        "GET /api/v1/stages/{id}/capacity",
        "GET /api/v1/storage",
        "GET /api/v1/submissions",
        "GET /api/v1/submissions/{id}",
        "GET /api/v1/submissions/{id}/ablation",
        "GET /api/v1/submissions/{id}/ablation/{profile}/{task}/{episode}/motion",
        "GET /api/v1/submissions/{id}/ablation/{profile}/{task}/{episode}/observed",
        "GET /api/v1/submissions/{id}/archive",
        "GET /api/v1/submissions/{id}/bundle",
        "GET /api/v1/teams",
        "GET /api/v1/teams/{id}",
        "GET /api/v1/teams/{id}/storage",
        "GET /api/v1/terms",
        "GET /api/v1/tokens",
        "GET /api/v1/tournaments",
        "GET /api/v1/tournaments/{id}",
        "GET /api/v1/tournaments/{id}/certainty",
        "GET /api/v1/tournaments/{id}/free-games",
        "GET /api/v1/tournaments/{id}/games",
        "GET /api/v1/tournaments/{id}/head-to-head",
        "GET /api/v1/tournaments/{id}/ratings",
        "GET /api/v1/tournaments/{id}/uncounted-games",
        "GET /api/v1/uploads/{blake3}",
        "GET /api/v1/webhooks",
        "GET /api/v1/webhooks/{id}",
        "GET /api/v1/webhooks/{id}/deliveries",
        "GET /api/v1/whoami",
        "GET /api/v1/workers",
        "PATCH /api/v1/people/{id}",
        "PATCH /api/v1/season",
        "PATCH /api/v1/stages/{id}",
        "PATCH /api/v1/submissions/{id}",
        "PATCH /api/v1/teams/{id}",
        "PATCH /api/v1/tournaments/{id}",
        "PATCH /api/v1/uploads/{blake3}",
        "PATCH /api/v1/webhooks/{id}",
        "POST /api/v1/announcements",
        "POST /api/v1/clock/accept",
        "POST /api/v1/days",
        "POST /api/v1/evaluations/{id}/cancel",
        "POST /api/v1/evaluations/{id}/dataset/link",
        "POST /api/v1/evaluations/{id}/publish",
        "POST /api/v1/evaluations/{id}/rerun",
        "POST /api/v1/evaluations/{id}/void",
        "POST /api/v1/games/{id}/recording/link",
        "POST /api/v1/games/{id}/rerun",
        "POST /api/v1/games/{id}/sides/{side}/link",
        "POST /api/v1/games/{id}/void",
        "POST /api/v1/invitations",
        "POST /api/v1/invitations/accept",
        "POST /api/v1/people/{id}/remove",
        "POST /api/v1/proposals/{id}/apply",
        "POST /api/v1/proposals/{id}/drop",
        "POST /api/v1/questions",
        "POST /api/v1/queue/pause",
        "POST /api/v1/queue/resume",
        "POST /api/v1/registrations",
        "POST /api/v1/registrations/{id}/approve",
        "POST /api/v1/registrations/{id}/refuse",
        "POST /api/v1/season/close",
        "POST /api/v1/sessions",
        "POST /api/v1/stages",
        "POST /api/v1/stages/{id}/days",
        "POST /api/v1/stages/{id}/days/{day}/extra-evaluation",
        "POST /api/v1/stages/{id}/days/{day}/extra-turn",
        "POST /api/v1/stages/{id}/days/{day}/void",
        "POST /api/v1/stages/{id}/final",
        "POST /api/v1/stages/{id}/finalise",
        "POST /api/v1/stages/{id}/freeze",
        "POST /api/v1/stages/{id}/proposals",
        "POST /api/v1/stages/{id}/trial",
        "POST /api/v1/stages/{id}/unfreeze",
        "POST /api/v1/submissions",
        "POST /api/v1/submissions/{id}/ablation",
        "POST /api/v1/submissions/{id}/activate",
        "POST /api/v1/submissions/{id}/archive/link",
        "POST /api/v1/submissions/{id}/bundle/link",
        "POST /api/v1/submissions/{id}/evaluations",
        "POST /api/v1/submissions/{id}/withdraw",
        "POST /api/v1/teams",
        "POST /api/v1/teams/{id}/disqualify",
        "POST /api/v1/teams/{id}/reinstate",
        "POST /api/v1/teams/{id}/retire",
        "POST /api/v1/teams/{id}/return",
        "POST /api/v1/teams/{id}/token",
        "POST /api/v1/terms",
        "POST /api/v1/terms/{version}/accept",
        "POST /api/v1/tokens",
        "POST /api/v1/tokens/{id}/rotate",
        "POST /api/v1/tournaments",
        "POST /api/v1/tournaments/{id}/close",
        "POST /api/v1/tournaments/{id}/departures",
        "POST /api/v1/tournaments/{id}/entrants",
        "POST /api/v1/tournaments/{id}/friendly-games",
        "POST /api/v1/tournaments/{id}/pause",
        "POST /api/v1/tournaments/{id}/replays",
        "POST /api/v1/tournaments/{id}/resume",
        "POST /api/v1/tournaments/{id}/rounds",
        "POST /api/v1/tournaments/{id}/test-games",
        "POST /api/v1/tournaments/{id}/withdrawal",
        "POST /api/v1/webhooks",
        "POST /api/v1/webhooks/{id}/rotate",
        "POST /api/v1/webhooks/{id}/test",
        "POST /api/v1/workers/{name}/ban",
        "POST /api/v1/workers/{name}/readmit",
        "PUT /api/v1/people/{id}/password",
        "PUT /api/v1/questions/{id}/answer",
    ];
    assert_eq!(listed, expected);

    let documentation = include_str!("../../../../docs/api.md");
    for line in expected {
        let line = line.replace("/api/v1", "");
        assert!(
            documentation.contains(&line),
            "docs/api.md does not mention {line}"
        );
    }
    let text = document.to_string();
    let mut remaining = text.as_str();
    while let Some(start) = remaining.find("#/components/") {
        remaining = &remaining[start + 1..];
        let pointer = &remaining[..remaining.find('"').unwrap()];
        assert!(
            document.pointer(pointer).is_some(),
            "{pointer} is referred to, but missing"
        );
    }
    assert_ne!(
        document["components"]["schemas"]["EvaluationView"],
        Value::Null
    );
    assert_ne!(
        document["components"]["securitySchemes"]["organiser"],
        Value::Null
    );
}

#[tokio::test]
async fn operations_list_the_responses_of_their_kind() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    let statuses = |method: &str, path: &str| -> Vec<String> {
        let pointer = format!("/paths/{}/{method}/responses", path.replace('/', "~1"));
        let responses = document.pointer(&pointer).unwrap().as_object().unwrap();
        responses.keys().cloned().collect()
    };
    assert_eq!(
        statuses("get", "/api/v1/health/live"),
        ["200", "429", "500", "503"]
    );
    // A paginated list.
    assert_eq!(
        statuses("get", "/api/v1/announcements"),
        ["200", "400", "422", "429", "500", "503"]
    );
    let page = "/paths/~1api~1v1~1announcements/get/responses/200/headers/Link";
    assert!(document.pointer(page).is_some());
    // The board takes a query and conditions. With a token it shows more, and parts of it are for organisers only.
    assert_eq!(
        statuses("get", "/api/v1/board"),
        [
            "200", "304", "400", "401", "403", "404", "429", "500", "503"
        ]
    );
    let dataset = statuses("get", "/api/v1/evaluations/{id}/dataset");
    for status in ["200", "206", "304", "416"] {
        assert!(dataset.iter().any(|listed| listed == status), "{status}");
    }
    assert_eq!(
        statuses("post", "/api/v1/stages/{id}/freeze"),
        [
            "200", "400", "401", "403", "404", "409", "413", "415", "422", "429", "500", "503",
            "507"
        ]
    );
    let upload = &document["paths"]["/api/v1/submissions"]["post"];
    let body = &upload["requestBody"]["content"]["application/octet-stream"]["schema"];
    assert_eq!(body["type"], "string");
    assert_eq!(body["contentMediaType"], "application/octet-stream");
    assert_ne!(
        upload["responses"]["201"]["headers"]["Location"],
        Value::Null
    );
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            for (status, response) in operation["responses"].as_object().unwrap() {
                let target = response["$ref"].as_str().map(|text| &text[1..]);
                let response =
                    target.map_or(response, |pointer| document.pointer(pointer).unwrap());
                let description = response["description"].as_str();
                assert!(
                    description.is_some_and(|description| !description.is_empty()),
                    "{method} {path} {status}: {response}"
                );
            }
        }
    }
}

#[tokio::test]
async fn upload_accepts_all_documented_media_types() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    let upload = &document["paths"]["/api/v1/submissions"]["post"];
    let media_types = upload["requestBody"]["content"].as_object().unwrap();
    assert!(media_types.len() > 1);
    for (index, media_type) in media_types.keys().enumerate() {
        // A team of its own, because the uploads of a team are limited.
        let team = site.team(&format!("Team {index}")).await;
        let request = site
            .request(Method::POST, "/api/v1/submissions", Some(&team.token))
            .header("content-type", media_type)
            .body(GZIP.to_vec());
        Answer::read(request.send().await.unwrap()).await.json(201);
    }
}

/// Serde also reads structs from arrays, by position. An earlier version accepted `[null, null]` as a change of the season.
#[tokio::test]
async fn array_instead_of_an_object_is_refused() {
    let site = Site::start().await;
    for (method, path, body) in [
        (Method::PATCH, "/api/v1/season", json!([null, null])),
        (Method::POST, "/api/v1/teams", json!(["Alpha"])),
        (
            Method::POST,
            "/api/v1/stages",
            json!({"name": "A", "weights": [0.4, 0.4, 0.2]}),
        ),
        (
            Method::POST,
            "/api/v1/stages",
            json!({"name": "A", "day_deadline": {"never": null}}),
        ),
        (
            Method::POST,
            "/api/v1/tournaments",
            json!({"name": "Cup", "rules": {"game_limits": [0.02, 10, 3600.0, 10.0]}}),
        ),
    ] {
        let request = site.request(method, path, Some(ADMIN)).json(&body);
        let answer = Answer::read(request.send().await.unwrap()).await;
        assert_eq!(answer.status, 422, "{path} {body}: {answer:?}");
    }
}
