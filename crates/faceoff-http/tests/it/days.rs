//! Tests of starting an evaluation day by a request of an organiser, and of the next cutoff (the moment at which each team's
//! active submission is fixed).

use crate::site::{ADMIN, Answer, Site};
use reqwest::Method;
use serde_json::json;

#[tokio::test]
async fn day_starts_once_and_lists_teams_without_submission() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    let gamma = site.team("Gamma").await;
    for (team, agent) in [(&alpha, "a"), (&beta, "b")] {
        site.valid_submission(team, agent).await;
    }
    let stage = site.stage().await;
    let body = json!({ "stage": stage });
    let day = site
        .post("/api/v1/days", Some(ADMIN), &body)
        .await
        .json(200);
    assert_eq!(day["day"], "2026-03-01");
    for (evaluation, name) in day["created"]
        .as_array()
        .unwrap()
        .iter()
        .zip(["Alpha", "Beta"])
    {
        assert_eq!(evaluation["team_name"], name);
        assert_eq!(evaluation["stage"], json!(stage));
        assert_eq!(evaluation["revision"], 1);
    }
    assert_eq!(day["without_submission"][0]["name"], "Gamma");

    // Further attempts fail, with and without a body, although another team has a submission now.
    site.valid_submission(&gamma, "g").await;
    site.advance(3600);
    for body in [Some(&body), None] {
        let mut request = site.request(Method::POST, "/api/v1/days", Some(ADMIN));
        if let Some(body) = body {
            request = request.json(body);
        }
        let again = Answer::read(request.send().await.unwrap()).await;
        let problem = again.problem(
            409,
            "cutoff-passed",
            &[
                "2026-03-01 10:00:00 UTC",
                "nothing was started",
                "2026-03-02",
            ],
        );
        assert_eq!(problem["day"], "2026-03-01");
        assert_eq!(
            problem["next_cutoff"],
            json!({
                "stage": stage,
                "stage_name": "Qualifying",
                "day": "2026-03-02",
                "at": null,
                "zone": "UTC",
            })
        );
    }
    let today = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
    assert_eq!(today.as_array().unwrap().len(), 2);
    let earlier_evaluations = site
        .get("/api/v1/evaluations?day=2026-02-28", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(earlier_evaluations, json!([]));
    site.next_day();
    let next = site.post("/api/v1/days", Some(ADMIN), &json!({})).await;
    assert_eq!(next.json(200)["created"].as_array().unwrap().len(), 3);
}

#[tokio::test]
async fn next_cutoff_follows_the_schedule() {
    let site = Site::start_with_schedule("12:00").await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let next_cutoff = async || {
        let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
        let season = site.get("/api/v1/season", None).await.json(200);
        assert_eq!(me["next_cutoff"], season["next_cutoff"]);
        me["next_cutoff"]["at"].clone()
    };
    assert_eq!(next_cutoff().await, "2026-03-01T12:00:00Z");
    // The organiser starts the day before the scheduled time, so the next cutoff of the schedule is on the next day.
    site.start_day().await;
    assert_eq!(next_cutoff().await, "2026-03-02T12:00:00Z");
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "cutoff-passed", &["2026-03-02 at 12:00:00 UTC"]);
}

#[tokio::test]
async fn refused_start_leaves_the_cutoff_available() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(
            409,
            "conflict",
            &[
                "no team has a valid submission",
                "its cutoff is still available",
            ],
        );
    let season = site.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["days"], json!([]));
    site.valid_submission(&team, "a").await;
    site.start_day().await;
}

#[tokio::test]
async fn invalid_day_request_starts_nothing() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let start = |body: serde_json::Value| {
        let site = &site;
        async move { site.post("/api/v1/days", Some(ADMIN), &body).await }
    };
    start(json!({ "stage": "first" }))
        .await
        .problem(422, "invalid-content", &["stage"]);
    start(json!({ "stage": uuid::Uuid::nil() }))
        .await
        .problem(404, "not-found", &["stage"]);
    // Earlier versions accepted a day's number of episodes. Now it is a setting of the stage.
    start(json!({ "episodes_per_task": 5 })).await.problem(
        422,
        "invalid-content",
        &["episodes_per_task"],
    );
    site.post("/api/v1/days", Some(&team.token), &json!({}))
        .await
        .problem(403, "forbidden", &[]);
    assert_eq!(
        site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200),
        json!([])
    );
}
