//! What a board's rows are made of: the newest, the best, a mean of days, or a final day.

use crate::site::{ADMIN, Answer, Site, outcome};
use faceoff_types::{EpisodeOutcome, Task, Violations};
use reqwest::Method;
use serde_json::{Value, json};

async fn change(site: &Site, body: Value) -> Answer {
    let path = format!("/api/v1/stages/{}", site.stage().await);
    let request = site.request(Method::PATCH, &path, Some(ADMIN));
    Answer::of(request.json(&body).send().await.unwrap()).await
}

/// Says how rows are made, of a stage that is open.
async fn set(site: &Site, standings: Value) {
    let body = json!({ "standings": standings, "confirm": "Qualifying" });
    let changed = change(site, body).await.json(200);
    assert_eq!(changed["standings"], standings);
}

/// Of 20 episodes, so many solved and so many with the end effector out of bounds, 3 points each.
fn agent(solved: u32, broken: u32) -> impl Fn(Task, u32) -> EpisodeOutcome {
    move |task, episode| EpisodeOutcome {
        success: episode < solved,
        violations: Violations {
            ee: episode < broken,
            ..Violations::default()
        },
        ..outcome(task, episode, false)
    }
}

/// Starts a day and plays Alpha's evaluation of it.
async fn day(site: &Site, played: impl Fn(Task, u32) -> EpisodeOutcome) -> String {
    site.next_day();
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    site.finish_as(played).await.to_string()
}

async fn board(site: &Site, path: &str) -> Value {
    site.get(&format!("/api/v1/board{path}"), None)
        .await
        .json(200)
}

#[tokio::test]
async fn rows_are_the_newest_the_best_or_means_as_the_stage_says() {
    let site = Site::start().await;
    let [first] = site.played_day(20, [("Alpha", &agent(10, 0))]).await;
    let second = day(&site, agent(16, 5)).await;
    let third = day(&site, agent(4, 1)).await;
    let first = first.to_string();

    let newest = board(&site, "").await;
    assert_eq!(
        (&newest["standings"], &newest["rows_by"]),
        (&json!("latest"), &json!("latest"))
    );
    assert_eq!(
        (&newest["provisional"], &newest["finalised"]),
        (&json!(true), &json!(null))
    );
    assert_eq!(
        (
            &newest["rows"][0]["evaluation"],
            &newest["rows"][0]["score"]
        ),
        (&json!(third), &json!(20.0))
    );
    let page = site.get("/", None).await.body;
    assert!(
        page.contains("Each team's newest finished evaluation")
            || page.contains("Each team&#39;s newest"),
        "{page}"
    );
    assert!(page.contains("The result is provisional"), "{page}");

    // The order of the board decides which is best: the tier before the score.
    set(&site, json!("best")).await;
    let best = board(&site, "").await;
    let row = &best["rows"][0];
    assert_eq!(
        (&row["evaluation"], &row["score"], &row["tier"]),
        (&json!(first), &json!(50.0), &json!("deployable"))
    );
    assert_eq!(row["evaluations"], json!([first]));
    assert!(
        site.get("/", None)
            .await
            .body
            .contains("stands highest by this board")
    );

    set(&site, json!({ "mean_of_last": 2 })).await;
    let mean = board(&site, "").await;
    let row = &mean["rows"][0];
    // 16 and 4 of 20; 15 and 3 points.
    assert_eq!(row["evaluations"], json!([second, third]));
    assert_eq!(
        (&row["score"], &row["penalty_points"]),
        (&json!(50.0), &json!(9.0))
    );
    assert_eq!(row["tier"], "deployable", "9 points over 20 episodes");
    let hit = &row["tasks"]["hit"];
    assert_eq!(
        (&hit["episodes"], &hit["successes"], &hit["success_rate"]),
        (&json!(40), &json!(20), &json!(0.5))
    );
    assert_eq!(hit["violations"]["ee"], 6);
    assert_eq!(
        (&row["seed"], &row["tier_change_probability"]),
        (&json!(null), &json!(null))
    );
    assert_eq!(
        board(&site, "/hit").await["rows"][0]["tasks"]["hit"]["success_rate"],
        0.5
    );
    let page = site.get("/", None).await.body;
    for words in [
        "mean of its last 2 days",
        "(mean of 2 days)",
        "0.45 per episode",
        "not computed of means",
    ] {
        assert!(page.contains(words), "{words} is not in {page}");
    }
    // More days than there are: all of them.
    set(&site, json!({ "mean_of_last": 90 })).await;
    assert_eq!(
        board(&site, "").await["rows"][0]["evaluations"],
        json!([first, second, third])
    );
    let html = scraper::Html::parse_document(&site.get("/tasks/hit", None).await.body);
    assert!(html.errors.is_empty(), "{:?}", html.errors);
}

#[tokio::test]
async fn means_of_the_same_days_are_paired_and_ranked_by_the_rules() {
    let site = Site::start().await;
    site.played_day(200, [("Alpha", &agent(100, 0)), ("Beta", &agent(120, 0))])
        .await;
    site.next_day();
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    for _ in 0..2 {
        site.finish_as(agent(100, 0)).await;
    }
    set(&site, json!({ "mean_of_last": 2 })).await;
    let mean = board(&site, "").await;
    let told = |row: &Value| {
        (
            row["team"].clone(),
            row["score"].clone(),
            row["rank_group"].clone(),
        )
    };
    assert_eq!(
        told(&mean["rows"][0]),
        (json!("Beta"), json!(55.0), json!(1))
    );
    // Beta solved 20 episodes of each task more, and Alpha none that Beta did not: no chance.
    assert_eq!(
        told(&mean["rows"][1]),
        (json!("Alpha"), json!(50.0), json!(2))
    );
}

#[tokio::test]
async fn other_standings_of_an_open_stage_are_confirmed() {
    let site = Site::start().await;
    let problem = change(&site, json!({ "standings": "best" })).await;
    let problem = problem.problem(409, "not-confirmed", &["best", "latest", "confirm"]);
    assert_eq!(problem["confirm"], "Qualifying");
    let stages = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(stages[0]["standings"], "latest", "nothing was done");
    set(&site, json!("best")).await;
}

#[tokio::test]
async fn a_final_day_decides_and_until_then_the_board_says_that_it_does() {
    let site = Site::start().await;
    site.played_day(20, [("Alpha", &agent(16, 0)), ("Beta", &agent(4, 0))])
        .await;
    set(&site, json!("final")).await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/final");
    let start = async || site.post(&path, Some(ADMIN), &json!({})).await;
    start()
        .await
        .problem(409, "conflict", &["has not closed", "no end yet"]);
    let before = board(&site, "").await;
    assert_eq!(
        (&before["standings"], &before["rows_by"]),
        (&json!("final"), &json!("latest"))
    );
    assert_eq!(before["rows"].as_array().unwrap().len(), 2);
    assert!(
        site.get("/", None)
            .await
            .body
            .contains("Only the final day counts")
    );

    change(&site, json!({ "closes_at": "2026-03-01T20:00:00Z" }))
        .await
        .json(200);
    site.later(11 * 3600);
    start().await.problem(
        409,
        "day-has-cut",
        &["2026-03-01", "a date of its own", "UTC"],
    );
    site.later(4 * 3600);
    for (token, status) in [(None, 401), (Some("fo_team_no"), 401)] {
        assert_eq!(
            site.post(&path, token, &json!({})).await.status.as_u16(),
            status
        );
    }
    let day = start().await.json(200);
    assert_eq!(
        (&day["day"], day["created"].as_array().unwrap().len()),
        (&json!("2026-03-02"), 2)
    );
    start()
        .await
        .problem(409, "conflict", &["had its cut", "there is one"]);
    // Beta alone has a result of the final day yet: the others are not on the board.
    site.finish_as(agent(5, 0)).await;
    let now = board(&site, "").await;
    assert_eq!(
        (&now["rows_by"], now["rows"].as_array().unwrap().len()),
        (&json!("final"), 1)
    );
    site.finish_as(agent(9, 0)).await;
    let scores: Vec<_> = board(&site, "").await["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["score"].clone())
        .collect();
    assert_eq!(scores, [json!(45.0), json!(25.0)]);
    assert!(
        site.get("/", None)
            .await
            .body
            .contains("evaluation of the final day")
    );
}

#[tokio::test]
async fn a_board_that_was_frozen_before_the_final_day_shows_on_what_it_showed() {
    let site = Site::start().await;
    site.played_day(20, [("Alpha", &agent(16, 0)), ("Beta", &agent(4, 0))])
        .await;
    set(&site, json!("final")).await;
    let path = format!("/api/v1/stages/{}", site.stage().await);
    change(&site, json!({ "closes_at": "2026-03-01T20:00:00Z" }))
        .await
        .json(200);
    let reason = json!({ "reason": "the finale is a surprise" });
    site.post(&format!("{path}/freeze"), Some(ADMIN), &reason)
        .await
        .json(200);
    let shown = board(&site, "").await["rows"].clone();
    assert_eq!(shown.as_array().unwrap().len(), 2);
    site.later(15 * 3600);
    site.post(&format!("{path}/final"), Some(ADMIN), &json!({}))
        .await
        .json(200);
    site.finish_as(agent(5, 0)).await;
    let frozen = board(&site, "").await;
    assert_eq!(
        (&frozen["rows"], &frozen["rows_by"]),
        (&shown, &json!("latest"))
    );
    let live = site
        .get("/api/v1/board?live=true", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(
        (&live["rows_by"], live["rows"].as_array().unwrap().len()),
        (&json!("final"), 1)
    );
}
