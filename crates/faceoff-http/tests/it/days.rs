use crate::site::{ADMIN, Answer, Site};
use reqwest::Method;
use serde_json::json;

#[tokio::test]
async fn starting_the_day_is_idempotent_and_names_who_is_left_out() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    site.team("Gamma").await;
    let early = site.valid_submission(&alpha, "a").await;
    site.valid_submission(&beta, "b").await;
    site.evaluate(&alpha, &early).await;

    let body = json!({ "episodes_per_task": 8, "profile": "ideal" });
    let day = site
        .post("/api/v1/days", Some(ADMIN), &body)
        .await
        .json(200);
    assert_eq!(day["day"], "2026-03-01");
    assert_eq!(day["created"][0]["team_name"], "Beta");
    assert_eq!(day["created"][0]["episodes_per_task"], 8);
    assert_eq!(day["created"][0]["profile"], "ideal");
    assert_eq!(day["existing"][0]["team_name"], "Alpha");
    assert_eq!(
        day["existing"][0]["episodes_per_task"], 4,
        "what runs already stays as it is"
    );
    assert_eq!(day["without_submission"][0]["name"], "Gamma");

    let again = site
        .request(Method::POST, "/api/v1/days", Some(ADMIN))
        .send()
        .await
        .unwrap();
    let again = Answer::of(again).await.json(200);
    assert_eq!(again["created"], json!([]), "a body may be left out");
    assert_eq!(again["existing"].as_array().unwrap().len(), 2);
    let today = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
    assert_eq!(today.as_array().unwrap().len(), 2);
    let before = site
        .get("/api/v1/evaluations?day=2026-02-28", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(before, json!([]));
}

#[tokio::test]
async fn a_day_that_cannot_be_is_refused_and_nothing_starts() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let start = |body: serde_json::Value| {
        let site = &site;
        async move { site.post("/api/v1/days", Some(ADMIN), &body).await }
    };
    start(json!({ "episodes_per_task": 0 })).await.problem(
        422,
        "invalid-content",
        &["episodes_per_task", "got 0"],
    );
    start(json!({ "episodes_per_task": 100_001 }))
        .await
        .problem(422, "invalid-content", &["100000"]);
    start(json!({ "profile": "easy" }))
        .await
        .problem(422, "invalid-content", &["easy"]);
    start(json!({ "episodes": 5 }))
        .await
        .problem(422, "invalid-content", &["episodes"]);
    site.post("/api/v1/days", Some(&team.token), &json!({}))
        .await
        .problem(403, "forbidden", &[]);
    assert_eq!(
        site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200),
        json!([])
    );
}
