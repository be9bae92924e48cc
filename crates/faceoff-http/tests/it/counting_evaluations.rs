//! Tests of the stage setting `standings`, which says which of a team's evaluations count on the board: the newest, the best, a
//! mean of several days, or that of a final day.

use crate::site::{ADMIN, Site, outcome};
use faceoff_airhockey::EE;
use faceoff_types::{EpisodeOutcome, Task};
use serde_json::{Value, json};

/// Sets which evaluations count, in an open stage.
async fn set_counting(site: &Site, standings: Value) {
    let body = json!({ "standings": standings, "confirm": "Qualifying" });
    let changed = site.change_first_stage(body).await.json(200);
    assert_eq!(changed["standings"], standings);
}

/// The outcomes of an agent that solves the first `solved` episodes of each task, and violates the bounds of the end effector
/// (3 penalty points) in the first `violated` ones.
fn outcomes_with(solved: u32, violated: u32) -> impl Fn(Task, u32) -> EpisodeOutcome {
    move |task, episode| EpisodeOutcome {
        success: episode < solved,
        violations: [(EE, episode < violated)].into_iter().collect(),
        ..outcome(task, episode, false)
    }
}

/// Starts the next day and runs Alpha's evaluation. Returns its id.
async fn run_day(site: &Site, outcome_fn: impl Fn(Task, u32) -> EpisodeOutcome) -> String {
    site.next_day();
    site.start_day().await;
    site.run_evaluation(outcome_fn).await.to_string()
}

/// The overall board (`path` is empty) or a task's (`/hit`).
async fn board(site: &Site, path: &str) -> Value {
    site.get(&format!("/api/v1/board{path}"), None)
        .await
        .json(200)
}

#[tokio::test]
async fn board_rows_are_newest_best_or_mean_as_configured() {
    let site = Site::start().await;
    let [first_evaluation] = site.run_day(20, [("Alpha", &outcomes_with(10, 0))]).await;
    let second = run_day(&site, outcomes_with(16, 5)).await;
    let third = run_day(&site, outcomes_with(4, 1)).await;
    let first_evaluation = first_evaluation.to_string();

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
        page.contains("Each team's latest finished evaluation")
            || page.contains("Each team&#39;s latest"),
        "{page}"
    );
    assert!(page.contains("The result is provisional"), "{page}");

    // The best evaluation is the highest by board order: first by tier, then by score.
    set_counting(&site, json!("best")).await;
    let best = board(&site, "").await;
    let row = &best["rows"][0];
    assert_eq!(
        (&row["evaluation"], &row["score"], &row["tier"]),
        (&json!(first_evaluation), &json!(50.0), &json!("deployable"))
    );
    assert_eq!(row["evaluations"], json!([first_evaluation]));
    assert!(
        site.get("/", None)
            .await
            .body
            .contains("best finished evaluation")
    );

    set_counting(&site, json!({ "mean_of_last": 2 })).await;
    let mean = board(&site, "").await;
    let row = &mean["rows"][0];
    // The mean of 16 and 4 solved episodes of 20, and of 15 and 3 points.
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
        "mean over its last 2 days",
        "(mean of 2 days)",
        "0.45 per episode",
        "Not computed where the board shows the mean of several days",
    ] {
        assert!(page.contains(words), "{words} is not in {page}");
    }
    // The team has fewer days than the mean allows, so all of them count.
    set_counting(&site, json!({ "mean_of_last": 90 })).await;
    assert_eq!(
        board(&site, "").await["rows"][0]["evaluations"],
        json!([first_evaluation, second, third])
    );
    site.get("/tasks/hit", None).await.html(200);
}

#[tokio::test]
async fn means_of_the_same_days_are_compared_pairwise() {
    let site = Site::start().await;
    site.run_day(
        200,
        [
            ("Alpha", &outcomes_with(100, 0)),
            ("Beta", &outcomes_with(120, 0)),
        ],
    )
    .await;
    site.next_day();
    site.start_day().await;
    for _ in 0..2 {
        site.run_evaluation(outcomes_with(100, 0)).await;
    }
    set_counting(&site, json!({ "mean_of_last": 2 })).await;
    let mean = board(&site, "").await;
    let summary = |row: &Value| {
        (
            row["team"].clone(),
            row["score"].clone(),
            row["rank_group"].clone(),
        )
    };
    assert_eq!(
        summary(&mean["rows"][0]),
        (json!("Beta"), json!(55.0), json!(1))
    );
    // Beta solved all of Alpha's episodes and 20 more of each task, so the difference is significant.
    assert_eq!(
        summary(&mean["rows"][1]),
        (json!("Alpha"), json!(50.0), json!(2))
    );
}

#[tokio::test]
async fn changed_counting_of_an_open_stage_needs_confirmation() {
    let site = Site::start().await;
    let problem = site
        .change_first_stage(json!({ "standings": "best" }))
        .await;
    let problem = problem.problem(409, "not-confirmed", &["best", "latest", "confirm"]);
    assert_eq!(problem["confirm"], "Qualifying");
    let stages = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(stages[0]["standings"], "latest", "nothing was done");
    set_counting(&site, json!("best")).await;
}

#[tokio::test]
async fn final_day_replaces_the_board_once_it_has_started() {
    let site = Site::start().await;
    site.run_day(
        20,
        [
            ("Alpha", &outcomes_with(16, 0)),
            ("Beta", &outcomes_with(4, 0)),
        ],
    )
    .await;
    set_counting(&site, json!("final")).await;
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

    site.change_first_stage(json!({ "closes_at": "2026-03-01T20:00:00Z" }))
        .await
        .json(200);
    site.advance(11 * 3600);
    start().await.problem(
        409,
        "cutoff-passed",
        &["2026-03-01", "a date of its own", "UTC"],
    );
    site.advance(4 * 3600);
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
        .problem(409, "conflict", &["had its cutoff", "only one"]);
    // Only one team has a result of the final day so far, so the board has one row.
    site.run_evaluation(outcomes_with(5, 0)).await;
    let current = board(&site, "").await;
    assert_eq!(
        (
            &current["rows_by"],
            current["rows"].as_array().unwrap().len()
        ),
        (&json!("final"), 1)
    );
    site.run_evaluation(outcomes_with(9, 0)).await;
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
async fn frozen_board_ignores_the_final_day() {
    let site = Site::start().await;
    site.run_day(
        20,
        [
            ("Alpha", &outcomes_with(16, 0)),
            ("Beta", &outcomes_with(4, 0)),
        ],
    )
    .await;
    set_counting(&site, json!("final")).await;
    let path = format!("/api/v1/stages/{}", site.stage().await);
    site.change_first_stage(json!({ "closes_at": "2026-03-01T20:00:00Z" }))
        .await
        .json(200);
    let reason = json!({ "reason": "the finale is a surprise" });
    site.post(&format!("{path}/freeze"), Some(ADMIN), &reason)
        .await
        .json(200);
    let rows_at_freeze = board(&site, "").await["rows"].clone();
    assert_eq!(rows_at_freeze.as_array().unwrap().len(), 2);
    site.advance(15 * 3600);
    site.post(&format!("{path}/final"), Some(ADMIN), &json!({}))
        .await
        .json(200);
    site.run_evaluation(outcomes_with(5, 0)).await;
    let frozen = board(&site, "").await;
    assert_eq!(
        (&frozen["rows"], &frozen["rows_by"]),
        (&rows_at_freeze, &json!("latest"))
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
