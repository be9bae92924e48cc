//! Tests of the publication of datasets (recordings of evaluations), by the stage or by their team.

use crate::site::{ADMIN, Site, TestTeam, result};
use serde_json::json;

/// When the stage closes: 23 hours after the start of the test.
const CLOSES_AT: &str = "2026-03-02T09:00:00Z";

/// A stage with an end, and a day of two teams. The first evaluation is finished, the second one is still queued.
async fn unfinished_day(site: &Site, publishes: &str) -> ([TestTeam; 2], String) {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    let submission = site.valid_submission(&teams[0], "a").await;
    site.valid_submission(&teams[1], "b").await;
    let settings = json!({ "publishes": publishes, "closes_at": CLOSES_AT });
    site.change_first_stage(settings).await.json(200);
    let path = site.start_evaluation(&teams[0], &submission).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    (teams, path)
}

/// Whether an evaluation is public; checks that its dataset is public or not accordingly.
async fn is_public(site: &Site, path: &str) -> bool {
    let answer = site.get(path, None).await;
    let dataset = site.get(&format!("{path}/dataset"), None).await;
    let organiser_view = site.get(path, Some(ADMIN)).await.json(200);
    if answer.status == 200 {
        assert_eq!(answer.json(200)["public"], true);
        assert_eq!(
            (dataset.status.as_u16(), dataset.header("content-type")),
            (200, "application/zip")
        );
        assert_eq!(organiser_view["public"], true);
        return true;
    }
    answer.problem(
        401,
        "unauthenticated",
        &["no such public evaluation", "Bearer"],
    );
    dataset.problem(401, "unauthenticated", &[]);
    assert_eq!(organiser_view["public"], false);
    false
}

#[tokio::test]
async fn datasets_are_public_when_the_stage_says() {
    for (publishes, at_release, at_close) in [
        ("at_close", false, true),
        ("at_release", true, true),
        ("never", false, false),
    ] {
        let site = Site::start().await;
        let ([alpha, beta], path) = unfinished_day(&site, publishes).await;
        assert!(
            !is_public(&site, &path).await,
            "another evaluation of the day still runs on the same episodes"
        );
        site.finish_evaluation(&result([0.1, 0.2, 0.3], 10.0)).await;
        assert_eq!(is_public(&site, &path).await, at_release, "{publishes}");
        let other_team_status = site.get(&path, Some(&beta.token)).await.status;
        assert_eq!(other_team_status == 200, at_release, "{publishes}");
        site.advance(23 * 3600);
        assert_eq!(is_public(&site, &path).await, at_close, "{publishes}");
        let page = site.get(&path.replace("/api/v1", ""), None).await.body;
        assert_eq!(
            page.contains("/dataset\">public: download"),
            at_close,
            "{page}"
        );
        if publishes == "never" {
            // The team may publish its dataset, and it stays public.
            let published = site
                .post(&format!("{path}/publish"), Some(&alpha.token), &json!({}))
                .await;
            assert_eq!(published.json(200)["public"], true);
            assert!(is_public(&site, &path).await);
        }
    }
}

#[tokio::test]
async fn closed_stage_can_publish_earlier_but_not_later() {
    let site = Site::start().await;
    site.change_first_stage(json!({ "closes_at": CLOSES_AT }))
        .await
        .json(200);
    site.set_time(CLOSES_AT.parse().unwrap());
    let earlier = site.change_first_stage(json!({ "publishes": "at_release" }));
    assert_eq!(earlier.await.json(200)["publishes"], "at_release");
    for later in ["at_close", "never"] {
        site.change_first_stage(json!({ "publishes": later }))
            .await
            .problem(409, "conflict", &["cannot be changed"]);
    }
}

#[tokio::test]
async fn team_publishes_its_dataset_after_the_release() {
    let site = Site::start().await;
    let ([alpha, beta], path) = unfinished_day(&site, "at_close").await;
    let publish = format!("{path}/publish");
    let post_publish = async |token: Option<&str>| site.post(&publish, token, &json!({})).await;
    post_publish(Some(&alpha.token)).await.problem(
        409,
        "not-yet",
        &["1 evaluations of 2026-03-01"],
    );
    let beta_evaluations = site
        .get("/api/v1/evaluations", Some(&beta.token))
        .await
        .json(200);
    let beta_evaluation = format!(
        "/api/v1/evaluations/{}",
        beta_evaluations[0]["id"].as_str().unwrap()
    );
    let publish_queued = format!("{beta_evaluation}/publish");
    site.post(&publish_queued, Some(&beta.token), &json!({}))
        .await
        .problem(409, "conflict", &["only a finished evaluation"]);
    site.finish_evaluation(&result([0.1, 0.2, 0.3], 10.0)).await;
    post_publish(None)
        .await
        .problem(401, "unauthenticated", &[]);
    post_publish(Some(ADMIN))
        .await
        .problem(403, "forbidden", &["team"]);
    // Before it is public, other teams do not learn that the evaluation exists.
    post_publish(Some(&beta.token))
        .await
        .problem(404, "not-found", &[]);
    assert!(!is_public(&site, &path).await);
    // To publish it once more is no error.
    for _ in 0..2 {
        assert_eq!(
            post_publish(Some(&alpha.token)).await.json(200)["public"],
            true
        );
    }
    assert!(is_public(&site, &path).await);
    post_publish(Some(&beta.token))
        .await
        .problem(403, "forbidden", &["belongs to another team"]);
    // The other team's dataset stays private.
    assert!(!is_public(&site, &beta_evaluation).await);
}

#[tokio::test]
async fn public_failed_evaluation_hides_faults_and_log() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    site.change_first_stage(json!({ "publishes": "at_release" }))
        .await
        .json(200);
    let path = site.start_evaluation(&team, &submission).await;
    // The plan of the run allows one agent fault, so two stop the evaluation.
    site.run_shards_with_faults(2).await;
    let team_view = site.get(&path, Some(&team.token)).await.json(200);
    assert!(team_view["log"].as_str().unwrap().contains("log of"));
    let public_view = site.get(&path, None).await.json(200);
    assert_eq!(
        (
            &public_view["state"],
            public_view.get("log"),
            public_view.get("faults")
        ),
        (&json!("agent_failed"), None, None)
    );
}
