//! When datasets are there for everybody.

use crate::site::{ADMIN, Answer, Site, TestTeam, result};
use reqwest::Method;
use serde_json::{Value, json};

const CLOSES: &str = "2026-03-02T09:00:00Z";

async fn change(site: &Site, body: Value) -> Answer {
    let path = format!("/api/v1/stages/{}", site.stage().await);
    let request = site.request(Method::PATCH, &path, Some(ADMIN));
    Answer::of(request.json(&body).send().await.unwrap()).await
}

/// A stage that closes, and of two teams the first one's finished evaluation, the second one's still queued.
async fn half_a_day(site: &Site, publishes: &str) -> ([TestTeam; 2], String) {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    let submission = site.valid_submission(&teams[0], "a").await;
    site.valid_submission(&teams[1], "b").await;
    let settings = json!({ "publishes": publishes, "closes_at": CLOSES });
    change(site, settings).await.json(200);
    let path = site.evaluate(&teams[0], &submission).await;
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    (teams, path)
}

async fn is_public(site: &Site, path: &str) -> bool {
    let answer = site.get(path, None).await;
    let dataset = site.get(&format!("{path}/dataset"), None).await;
    let owner_says = site.get(path, Some(ADMIN)).await.json(200)["public"].clone();
    if answer.status == 200 {
        assert_eq!(answer.json(200)["public"], true);
        assert_eq!(
            (dataset.status.as_u16(), dataset.header("content-type")),
            (200, "application/zip")
        );
        assert_eq!(owner_says, true);
        return true;
    }
    answer.problem(
        401,
        "unauthenticated",
        &["no such evaluation that is public", "Bearer"],
    );
    dataset.problem(401, "unauthenticated", &[]);
    assert_eq!(owner_says, false);
    false
}

#[tokio::test]
async fn a_stages_datasets_are_public_from_its_close_unless_it_says_otherwise() {
    for (publishes, at_release, at_close) in [
        ("at_close", false, true),
        ("at_release", true, true),
        ("never", false, false),
    ] {
        let site = Site::start().await;
        let ([alpha, beta], path) = half_a_day(&site, publishes).await;
        assert!(
            !is_public(&site, &path).await,
            "others play the same episodes"
        );
        site.finish(&result([0.1, 0.2, 0.3], 10.0)).await;
        assert_eq!(is_public(&site, &path).await, at_release, "{publishes}");
        let other = site.get(&path, Some(&beta.token)).await.status;
        assert_eq!(other == 200, at_release, "{publishes}");
        site.later(23 * 3600);
        assert_eq!(is_public(&site, &path).await, at_close, "{publishes}");
        let page = site.get(&path.replace("/api/v1", ""), None).await.body;
        assert_eq!(
            page.contains("/dataset\">public: download"),
            at_close,
            "{page}"
        );
        if publishes == "never" {
            // The team may, and it stays so.
            let published = site
                .post(&format!("{path}/publish"), Some(&alpha.token), &json!({}))
                .await;
            assert_eq!(published.json(200)["public"], true);
            assert!(is_public(&site, &path).await);
        }
    }
}

#[tokio::test]
async fn a_team_publishes_its_own_and_not_before_the_release() {
    let site = Site::start().await;
    let ([alpha, beta], path) = half_a_day(&site, "at_close").await;
    let publish = format!("{path}/publish");
    let ask = async |token: Option<&str>| site.post(&publish, token, &json!({})).await;
    ask(Some(&alpha.token))
        .await
        .problem(409, "not-yet", &["1 evaluations of 2026-03-01"]);
    let running = site
        .get("/api/v1/evaluations", Some(&beta.token))
        .await
        .json(200);
    let running = format!(
        "/api/v1/evaluations/{}/publish",
        running[0]["id"].as_str().unwrap()
    );
    site.post(&running, Some(&beta.token), &json!({}))
        .await
        .problem(409, "conflict", &["only a finished evaluation"]);
    site.finish(&result([0.1, 0.2, 0.3], 10.0)).await;
    ask(None).await.problem(401, "unauthenticated", &[]);
    ask(Some(ADMIN)).await.problem(403, "forbidden", &["team"]);
    ask(Some(&beta.token)).await.problem(404, "not-found", &[]);
    assert!(!is_public(&site, &path).await);
    for _ in 0..2 {
        assert_eq!(ask(Some(&alpha.token)).await.json(200)["public"], true);
    }
    assert!(is_public(&site, &path).await);
    ask(Some(&beta.token))
        .await
        .problem(403, "forbidden", &["another team's"]);
    // The other one's is still its own.
    let of_beta = running.replace("/publish", "");
    assert!(!is_public(&site, &of_beta).await);
}

#[tokio::test]
async fn what_an_agent_wrote_stays_its_teams_when_its_failure_is_public() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    change(&site, json!({ "publishes": "at_release" }))
        .await
        .json(200);
    let path = site.evaluate(&team, &submission).await;
    site.play_shards(2).await;
    let own = site.get(&path, Some(&team.token)).await.json(200);
    assert!(own["log"].as_str().unwrap().contains("log of"));
    let all = site.get(&path, None).await.json(200);
    assert_eq!(
        (&all["state"], all.get("log"), all.get("faults")),
        (&json!("agent_failed"), None, None)
    );
}
