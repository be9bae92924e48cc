//! Tests of old names from earlier versions: fields, routes and anchors that work until the next minor version.

use crate::site::{ADMIN, Site};
use reqwest::Method;
use serde_json::{Value, json};

#[tokio::test]
async fn old_route_answers_like_its_new_one() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "striker").await;
    let [old, new] = ["archive", "bundle"].map(|name| format!("{submission}/{name}"));
    let downloaded = site.get(&old, Some(&team.token)).await;
    assert_eq!(
        downloaded.body,
        site.get(&new, Some(&team.token)).await.body
    );
    assert_eq!(downloaded.status, 200);
    let link = site
        .post(&format!("{old}/link"), Some(&team.token), &json!({}))
        .await
        .json(201);
    let url = link["url"].as_str().unwrap();
    assert!(url.starts_with(&new), "{url}");
    assert_eq!(site.get(url, None).await.status, 200);

    site.team("Beta").await;
    let tournament = json!({ "name": "Cup", "teams": ["Alpha", "Beta"] });
    let cup = site
        .post("/api/v1/tournaments", Some(ADMIN), &tournament)
        .await
        .json(201);
    let path = format!("/api/v1/tournaments/{}", cup["id"].as_str().unwrap());
    for name in ["free-games", "uncounted-games"] {
        let listed = site.get(&format!("{path}/{name}"), Some(ADMIN)).await;
        assert_eq!(listed.json(200), json!([]));
    }
}

#[tokio::test]
async fn response_sends_old_names_beside_new_ones() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "striker").await;
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_ne!(me["today"]["day"], Value::Null);
    assert_eq!(
        (&me["turn"], &me["next_cut"]),
        (&me["today"], &me["next_cutoff"])
    );

    site.start_day().await;
    let refused = site.post("/api/v1/days", Some(ADMIN), &json!({})).await;
    let problem = refused.problem(409, "cutoff-passed", &[]);
    assert_ne!(problem["cutoff_at"], Value::Null);
    assert_eq!(problem["cut_at"], problem["cutoff_at"]);
}

#[tokio::test]
async fn document_marks_old_names_as_deprecated() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    for (method, path) in [
        ("get", "/api/v1/submissions/{id}/archive"),
        ("post", "/api/v1/submissions/{id}/archive/link"),
        ("post", "/api/v1/stages/{id}/days/{day}/extra-turn"),
        ("get", "/api/v1/tournaments/{id}/free-games"),
    ] {
        assert_eq!(
            document["paths"][path][method]["deprecated"], true,
            "{path}"
        );
    }
    let schemas = &document["components"]["schemas"];
    for (schema, old, new) in [
        ("MeView", "turn", "today"),
        ("QueueView", "place", "position"),
        ("SeasonDay", "cut_at", "cutoff_at"),
        ("TaskComparison", "told_apart", "significant"),
        ("WorkersView", "troubles", "problems"),
    ] {
        let schema = &schemas[schema];
        assert_eq!(schema["properties"][old]["deprecated"], true, "{old}");
        let required = schema["required"].as_array().unwrap();
        assert!(!required.contains(&json!(old)), "{old}");
        assert!(schema["properties"][new]["deprecated"].is_null(), "{new}");
    }
    // Fields of schemas with alternatives.
    for (schema, old) in [
        ("DeliveryView", "settled_at"),
        ("EvaluationView", "extra_turn"),
        ("GameView", "asked_by"),
        ("SubmissionView", "archive_removed"),
    ] {
        let alternatives = schemas[schema]["oneOf"].as_array().unwrap();
        let has_old = |schema: &Value| schema["properties"][old]["deprecated"] == true;
        assert!(alternatives.iter().any(has_old), "{schema} {old}");
    }
}

#[tokio::test]
async fn old_anchors_of_problems_stay() {
    let site = Site::start().await;
    let request = site.request(Method::GET, "/problems", None);
    let page = request.send().await.unwrap().text().await.unwrap();
    for id in [
        "cutoff-passed",
        "day-has-cut",
        "daily-game-quota-exceeded",
        "free-games-spent",
    ] {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
}
