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
        "DELETE /api/v1/games/{id}",
        "DELETE /api/v1/invitations/{id}",
        "DELETE /api/v1/sessions/current",
        "DELETE /api/v1/submissions/{id}",
        "DELETE /api/v1/tokens/{id}",
        "DELETE /api/v1/tournaments/{id}/replays",
        "GET /api/v1/announcements",
        "GET /api/v1/board",
        "GET /api/v1/board/{task}",
        "GET /api/v1/evaluations",
        "GET /api/v1/evaluations/{id}",
        "GET /api/v1/evaluations/{id}/compare/{other}",
        "GET /api/v1/evaluations/{id}/dataset",
        "GET /api/v1/evaluations/{id}/violations",
        "GET /api/v1/events",
        "GET /api/v1/games/{id}",
        "GET /api/v1/games/{id}/attempts",
        "GET /api/v1/games/{id}/live",
        "GET /api/v1/games/{id}/recording",
        "GET /api/v1/games/{id}/sides/{side}",
        "GET /api/v1/games/{id}/sides/{side}/log",
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
        "GET /api/v1/submissions/{id}/archive",
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
        "GET /api/v1/whoami",
        "PATCH /api/v1/season",
        "PATCH /api/v1/stages/{id}",
        "PATCH /api/v1/submissions/{id}",
        "PATCH /api/v1/teams/{id}",
        "PATCH /api/v1/tournaments/{id}",
        "POST /api/v1/announcements",
        "POST /api/v1/days",
        "POST /api/v1/evaluations/{id}/cancel",
        "POST /api/v1/evaluations/{id}/publish",
        "POST /api/v1/evaluations/{id}/rerun",
        "POST /api/v1/evaluations/{id}/void",
        "POST /api/v1/games/{id}/rerun",
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
        "PUT /api/v1/people/{id}/password",
        "PUT /api/v1/questions/{id}/answer",
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
