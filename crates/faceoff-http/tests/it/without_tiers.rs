//! Tests of a competition without tiers: boards rank by score, and neither pages nor files nor the API name a tier.

use crate::{
    browser::Browser,
    html::{page, texts},
    site::{ADMIN, Site, result},
};
use faceoff_types::EvaluationResult;
use serde_json::json;

/// A result as a competition without tiers has it.
fn without_tier(rates: [f64; 3], penalty_points: f64) -> EvaluationResult {
    let mut result = result(rates, penalty_points);
    result.tier = None;
    for task in result.tasks.values_mut() {
        task.tier = None;
    }
    result
}

/// The best team has by far the most penalty points.
async fn site_with_results() -> Site {
    let site = Site::start().await.without_tiers().await;
    let teams = [
        ("Careful", without_tier([0.4; 3], 0.0)),
        ("Reckless", without_tier([0.9; 3], 5000.0)),
        ("Same", without_tier([0.4; 3], 10.0)),
    ];
    site.add_ranked_teams(&teams).await;
    site
}

#[tokio::test]
async fn board_without_tiers_ranks_by_score_alone() {
    let site = site_with_results().await;
    for path in ["/", "/tasks/hit", "/?sort=score"] {
        let html = page(&site, path).await;
        assert_eq!(
            texts(&html, ".board th.team > a"),
            ["Reckless", "Careful", "Same"],
            "{path}"
        );
        assert_eq!(texts(&html, ".board tbody").len(), 1, "{path}");
        assert_eq!(texts(&html, ".board .group").len(), 0, "{path}");
    }
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board.get("tier_bounds"), None);
    let first = &board["rows"][0];
    assert_eq!(
        (&first["team"], &first["rank"]),
        (&json!("Reckless"), &json!(1))
    );
    assert_eq!(first.get("tier"), None);
    assert_eq!(first["tasks"]["hit"].get("tier"), None);
    assert_eq!(first["tier_change_probability"], json!(null));
}

#[tokio::test]
async fn pages_and_files_without_tiers_do_not_name_them() {
    let site = site_with_results().await;
    let board = site.get("/api/v1/board", None).await.json(200);
    let [team, evaluation] =
        ["team_id", "evaluation"].map(|key| board["rows"][0][key].as_str().unwrap().to_owned());
    for path in [
        "/".to_owned(),
        "/?sort=score".to_owned(),
        "/tasks/hit".to_owned(),
        format!("/teams/{team}"),
        format!("/evaluations/{evaluation}"),
        "/api/v1/board?format=csv".to_owned(),
        "/api/v1/board/history?format=csv".to_owned(),
        "/api/v1/board/history".to_owned(),
        format!("/api/v1/evaluations/{evaluation}"),
    ] {
        // Visitors read evaluations on their pages; the API shows them to their team and to organisers.
        let token = path.starts_with("/api/v1/evaluations").then_some(ADMIN);
        let answer = site.get(&path, token).await;
        assert_eq!(answer.status, 200, "{path}: {}", answer.body);
        let text = answer.body.to_lowercase();
        let found = text.find("tier").map(|at| &text[at..]);
        assert_eq!(
            found.map(|rest| &rest[..rest.len().min(80)]),
            None,
            "{path}"
        );
    }
}

#[tokio::test]
async fn stage_without_tiers_refuses_their_bounds() {
    let site = Site::start().await.without_tiers().await;
    let bounds = json!({ "tier_bounds": { "deployable": 0.5, "improvable": 1.5 } });
    site.change_first_stage(bounds).await.problem(
        422,
        "invalid-content",
        &["tier_bounds", "has no tiers", "leave them out"],
    );
}

#[tokio::test]
async fn all_teams_qualify_without_tiers() {
    let site = site_with_results().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    let form = grace.open("/organiser/tournaments").await.html(200);
    let label = texts(&form, "label[for=teams]").remove(0);
    assert!(
        label.contains("for all ranked teams of the stage"),
        "{label}"
    );
    let stage = site.stage().await;
    let body = json!({ "name": "Cup", "stage": stage });
    let opened = site.post("/api/v1/tournaments", Some(ADMIN), &body).await;
    let opened = opened.json(201);
    assert_eq!(opened["entrants"].as_array().unwrap().len(), 3, "{opened}");
}
