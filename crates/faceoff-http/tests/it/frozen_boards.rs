//! Tests of frozen boards: who sees results that came after the boards of a stage were frozen.

use crate::site::{ADMIN, Site, TestTeam, result};
use serde_json::{Value, json};

const REASON: &str = "the last week is a surprise";

/// Freezes the boards of a stage whose datasets become public at the release of each day. Returns two teams, and the API paths
/// of three evaluations: the first team's before and after the freeze, and the second team's after it.
async fn frozen_stage(site: &Site) -> ([TestTeam; 2], [String; 3]) {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    site.change_first_stage(json!({ "publishes": "at_release" }))
        .await
        .json(200);
    let alpha_submission = site.valid_submission(&teams[0], "a").await;
    let before = site.start_evaluation(&teams[0], &alpha_submission).await;
    site.finish_evaluation(&result([0.5, 0.5, 0.5], 10.0)).await;
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    site.post(&freeze, Some(ADMIN), &json!({ "reason": REASON }))
        .await
        .json(200);
    site.next_day();
    let beta_submission = site.valid_submission(&teams[1], "b").await;
    let after = site.start_evaluation(&teams[0], &alpha_submission).await;
    let beta_after = site.start_evaluation(&teams[1], &beta_submission).await;
    site.finish_evaluation(&result([1.0, 1.0, 1.0], 20.0)).await;
    site.finish_evaluation(&result([0.7, 0.7, 0.7], 30.0)).await;
    (teams, [before, after, beta_after])
}

#[tokio::test]
async fn frozen_results_are_visible_to_their_team_only() {
    let site = Site::start().await;
    let ([alpha, beta], [before, after, beta_after]) = frozen_stage(&site).await;
    let list = site
        .get("/api/v1/evaluations", Some(&alpha.token))
        .await
        .json(200);
    let scores: Vec<_> = list.as_array().unwrap().iter().collect();
    let scores: Vec<_> = scores
        .iter()
        .map(|evaluation| evaluation["result"]["score"].as_f64())
        .collect();
    assert_eq!(scores, [Some(100.0), Some(50.0)]);
    let team_view = site.get(&after, Some(&alpha.token)).await.json(200);
    assert_eq!(
        (&team_view["result"]["score"], &team_view["public"]),
        (&json!(100.0), &json!(false))
    );
    assert_eq!(
        team_view["result"]["tasks"]["hit"]["violations"]["ee"], 7,
        "the day is released"
    );
    for (key, expected) in [("rank", Value::Null), ("rank_group", Value::Null)] {
        assert_eq!(team_view.get(key).cloned().unwrap_or_default(), expected);
    }
    let dataset = site
        .get(&format!("{after}/dataset"), Some(&alpha.token))
        .await;
    assert_eq!(dataset.status, 200);
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert!(!me.to_string().contains("rank"), "{me}");

    // Other teams and visitors see nothing, although the stage publishes at the release.
    for path in [
        after.clone(),
        format!("{after}/dataset"),
        format!("{after}/violations"),
    ] {
        site.get(&path, Some(&beta.token))
            .await
            .problem(404, "not-found", &[]);
        site.get(&path, None)
            .await
            .problem(401, "unauthenticated", &[]);
    }
    assert_eq!(
        site.get(&before, None).await.json(200)["public"],
        true,
        "it was released before the freeze"
    );
    let publish = format!("{after}/publish");
    site.post(&publish, Some(&alpha.token), &json!({}))
        .await
        .problem(409, "not-yet", &["frozen since", REASON, "published once"]);
    // Comparisons are hidden from all teams.
    let beta_id = beta_after.rsplit('/').next().unwrap();
    let compare = format!("{after}/compare/{beta_id}");
    for token in [None, Some(alpha.token.as_str()), Some(&beta.token)] {
        site.get(&compare, token)
            .await
            .problem(409, "not-yet", &["frozen", REASON]);
        let board = site.get("/api/v1/board", token).await.json(200);
        assert_eq!(board["rows"].as_array().unwrap().len(), 1);
        assert_eq!(board["rows"][0]["score"], 50.0);
        let page = site.get(&after.replace("/api/v1", ""), token).await.body;
        assert!(
            page.contains("are frozen since") && !page.contains("100.0"),
            "{page}"
        );
    }
    // The organiser sees everything.
    assert_eq!(
        site.get(&after, Some(ADMIN)).await.json(200)["result"]["score"],
        100.0
    );
    let page = site
        .get(&after.replace("/api/v1", ""), Some(ADMIN))
        .await
        .body;
    assert!(page.contains("100.0"), "{page}");
    site.get(&compare, Some(ADMIN)).await.json(200);

    let unfreeze = format!("/api/v1/stages/{}/unfreeze", site.stage().await);
    site.post(&unfreeze, Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(site.get(&after, None).await.json(200)["public"], true);
    assert_eq!(site.get(&compare, None).await.status, 200);
    site.post(&publish, Some(&alpha.token), &json!({}))
        .await
        .json(200);
}
