use crate::site::Site;
use serde_json::Value;

#[tokio::test]
async fn the_document_lists_what_is_there_and_nothing_else() {
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
        "GET /api/v1/board",
        "GET /api/v1/board/{task}",
        "GET /api/v1/evaluations",
        "GET /api/v1/evaluations/{id}",
        "GET /api/v1/evaluations/{id}/compare/{other}",
        "GET /api/v1/evaluations/{id}/dataset",
        "GET /api/v1/evaluations/{id}/violations",
        "GET /api/v1/events",
        "GET /api/v1/health",
        "GET /api/v1/health/live",
        "GET /api/v1/me",
        "GET /api/v1/season",
        "GET /api/v1/stages",
        "GET /api/v1/stages/{id}",
        "GET /api/v1/submissions",
        "GET /api/v1/submissions/{id}",
        "GET /api/v1/submissions/{id}/ablation",
        "GET /api/v1/teams",
        "PATCH /api/v1/stages/{id}",
        "PATCH /api/v1/submissions/{id}",
        "POST /api/v1/days",
        "POST /api/v1/evaluations/{id}/cancel",
        "POST /api/v1/evaluations/{id}/publish",
        "POST /api/v1/evaluations/{id}/rerun",
        "POST /api/v1/evaluations/{id}/void",
        "POST /api/v1/queue/pause",
        "POST /api/v1/queue/resume",
        "POST /api/v1/season/close",
        "POST /api/v1/stages",
        "POST /api/v1/stages/{id}/days/{day}/void",
        "POST /api/v1/stages/{id}/final",
        "POST /api/v1/stages/{id}/finalise",
        "POST /api/v1/submissions",
        "POST /api/v1/submissions/{id}/ablation",
        "POST /api/v1/submissions/{id}/activate",
        "POST /api/v1/submissions/{id}/evaluations",
        "POST /api/v1/submissions/{id}/withdraw",
        "POST /api/v1/teams",
        "POST /api/v1/teams/{id}/disqualify",
        "POST /api/v1/teams/{id}/reinstate",
        "POST /api/v1/teams/{id}/token",
    ];
    assert_eq!(listed, expected);

    let documentation = include_str!("../../../../docs/api.md");
    for line in expected {
        let line = line.replace("/api/v1", "");
        assert!(
            documentation.contains(&line),
            "docs/api.md does not tell of {line}"
        );
    }
    let text = document.to_string();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("#/components/") {
        rest = &rest[at + 1..];
        let pointer = &rest[..rest.find('"').unwrap()];
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
