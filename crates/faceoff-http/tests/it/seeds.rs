//! Nobody learns a day's seed while it could help: the one rule, over HTTP.

use crate::site::{ADMIN, Site, TestTeam, result};
use serde_json::{Value, json};

/// Everything that a visitor or the team itself can read.
async fn shown(site: &Site, team: &TestTeam, evaluation: &str) -> String {
    let mut all = String::new();
    let public = [
        "/",
        "/tasks/hit",
        "/season",
        "/api/v1/board",
        "/api/v1/season",
    ];
    for path in public {
        all += &site.get(path, None).await.body;
    }
    all += &site
        .get(&evaluation.replace("/api/v1", ""), None)
        .await
        .body;
    for path in [evaluation, "/api/v1/evaluations", "/api/v1/me"] {
        all += &site.get(path, Some(&team.token)).await.body;
    }
    all += &site.get("/api/v1/evaluations", Some(ADMIN)).await.body;
    all
}

#[tokio::test]
async fn a_team_that_finishes_early_learns_no_seed_while_others_play() {
    let site = Site::start().await;
    let (first, second) = (site.team("First").await, site.team("Second").await);
    let submissions = [
        site.valid_submission(&first, "f").await,
        site.valid_submission(&second, "s").await,
    ];
    let early = site.evaluate(&first, &submissions[0]).await;
    let other = site.evaluate(&second, &submissions[1]).await;
    let secret = site.store.season().await.unwrap().secret;
    let today = jiff::civil::date(2026, 3, 1);
    let seed = secret.day(today);
    let mut score = result([0.5, 0.6, 0.7], 100.0);
    score.seed = seed;
    site.finish(&score).await;
    let dataset = format!("{early}/dataset");

    // The other team's evaluation is queued, then running.
    for _ in 0..2 {
        for token in [&*first.token, ADMIN] {
            let refused = site.get(&dataset, Some(token)).await;
            let problem = refused.problem(409, "not-yet", &["1 evaluations of 2026-03-01"]);
            assert_eq!(problem["under_way"], 1);
            assert_eq!(refused.header("retry-after"), "30");
        }
        assert!(
            !shown(&site, &first, &early)
                .await
                .contains(&seed.to_string())
        );
        let (claim, ..) = site.claim_shard().await;
        site.store.release(&claim, site.now()).await.unwrap();
    }
    site.finish(&score).await;
    // Looking at pages releases nothing: a dataset does.
    assert!(
        !shown(&site, &first, &early)
            .await
            .contains(&seed.to_string())
    );
    assert_eq!(site.get(&dataset, Some(&first.token)).await.status, 200);
    let finished = site.get(&early, Some(&first.token)).await.json(200);
    assert_eq!(finished["result"]["seed"], seed.to_string());
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["seed"], seed.to_string());

    // An agent that is uploaded now could know the episodes.
    let late = site.team("Late").await;
    let submission = site.valid_submission(&late, "l").await;
    let evaluations = format!("{submission}/evaluations");
    let problem = site
        .post(&evaluations, Some(&late.token), &json!({}))
        .await
        .problem(
            409,
            "day-released",
            &["2026-03-01", "10:00:00 UTC", "2026-03-02"],
        );
    assert_eq!(problem["next_turn"], "2026-03-02");
    let day = site
        .post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(day["created"], json!([]));
    assert_eq!(day["without_submission"][0]["name"], "Late");

    site.next_day();
    site.evaluate(&late, &submission).await;
    let tomorrow = secret.day(today.tomorrow().unwrap()).to_string();
    assert!(!shown(&site, &first, &early).await.contains(&tomorrow));
    // Yesterday's dataset stays free while today's evaluations run.
    assert_eq!(site.get(&dataset, Some(&first.token)).await.status, 200);
    let _ = other;
}

#[tokio::test]
async fn what_was_uploaded_before_the_release_still_has_its_turn() {
    let site = Site::start().await;
    let (first, second) = (site.team("First").await, site.team("Second").await);
    let submission = site.valid_submission(&first, "f").await;
    // The clock of the test stands still: one second between upload and release.
    let waiting = site.valid_submission(&second, "s").await;
    let early = site.evaluate(&first, &submission).await;
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    site.later(1);
    let dataset = format!("{early}/dataset");
    assert_eq!(site.get(&dataset, Some(&first.token)).await.status, 200);
    site.later(1);
    let path = site.evaluate(&second, &waiting).await;
    // What is released is released.
    assert_eq!(site.get(&dataset, Some(&first.token)).await.status, 200);
    site.finish(&result([0.1, 0.1, 0.1], 0.0)).await;
    assert_eq!(
        site.get(&format!("{path}/dataset"), Some(&second.token))
            .await
            .status,
        200
    );
}

#[tokio::test]
async fn the_mismatch_seed_is_on_no_page_before_the_close() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    let path = site.evaluate(&team, &submission).await;
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    site.next_day();
    let secret = site.store.season().await.unwrap().secret;
    let shown = shown(&site, &team, &path).await;
    assert!(!shown.contains(&secret.model_mismatch().to_string()));
    assert!(!shown.contains(&secret.to_string()));
    let season: Value = site.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["mismatch_seed"], json!(null));
    let yesterday = jiff::civil::date(2026, 3, 1);
    assert_eq!(season["days"][0]["seed"], secret.day(yesterday).to_string());
}
