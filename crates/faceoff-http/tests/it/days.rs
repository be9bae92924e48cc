use crate::site::{ADMIN, Answer, Site};
use reqwest::Method;
use serde_json::json;

#[tokio::test]
async fn a_day_starts_once_with_what_is_active_and_names_who_is_left_out() {
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

    // However often, with whatever body, and whoever has something to play now.
    site.valid_submission(&gamma, "g").await;
    site.later(3600);
    for again in [Some(&body), None] {
        let mut request = site.request(Method::POST, "/api/v1/days", Some(ADMIN));
        if let Some(body) = again {
            request = request.json(body);
        }
        let again = Answer::of(request.send().await.unwrap()).await;
        let problem = again.problem(
            409,
            "day-has-cut",
            &[
                "2026-03-01 10:00:00 UTC",
                "nothing was started",
                "2026-03-02",
            ],
        );
        assert_eq!(problem["day"], "2026-03-01");
        assert_eq!(
            problem["next_cut"],
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
    let before = site
        .get("/api/v1/evaluations?day=2026-02-28", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(before, json!([]));
    site.next_day();
    let next = site.post("/api/v1/days", Some(ADMIN), &json!({})).await;
    assert_eq!(next.json(200)["created"].as_array().unwrap().len(), 3);
}

#[tokio::test]
async fn the_next_cut_is_the_schedules_where_there_is_one() {
    let site = Site::start_daily("12:00").await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let next_cut = async || {
        let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
        let season = site.get("/api/v1/season", None).await.json(200);
        assert_eq!(me["next_cut"], season["next_cut"]);
        me["next_cut"]["at"].clone()
    };
    assert_eq!(next_cut().await, "2026-03-01T12:00:00Z");
    // By hand, before the schedule would: the schedule's cut is the next day's.
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(next_cut().await, "2026-03-02T12:00:00Z");
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "day-has-cut", &["2026-03-02 at 12:00:00 UTC"]);
}

#[tokio::test]
async fn a_day_without_anything_to_play_keeps_its_cut() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(
            409,
            "conflict",
            &["no team has a valid submission", "still has its cut"],
        );
    let season = site.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["days"], json!([]));
    site.valid_submission(&team, "a").await;
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
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
    start(json!({ "stage": "first" }))
        .await
        .problem(422, "invalid-content", &["stage"]);
    start(json!({ "stage": uuid::Uuid::nil() }))
        .await
        .problem(404, "not-found", &["stage"]);
    // Of a day's own there were episodes and a profile; now they are the stage's.
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
