//! Tests of an organiser's decisions that need a confirmation: their preview (the description of their effects), their effects,
//! and who may make and see them.

use crate::site::{ADMIN, GZIP, Site, result};
use serde_json::{Value, json};

/// The reason of all decisions. It contains HTML, which pages must escape.
const REASON: &str = "the <table> was tilted";

/// The names of the teams on the board.
async fn board_teams(site: &Site) -> Value {
    let board = site.get("/api/v1/board", None).await.json(200);
    board["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["team"].clone())
        .collect()
}

/// Checks that a decision needs the confirmation `confirm`: without it nothing is done, and the response describes the effects
/// with `words`. Then makes the decision. Returns the response.
async fn confirm_decision(site: &Site, path: &str, confirm: &str, words: &[&str]) -> Value {
    let post = async |body: Value| site.post(path, Some(ADMIN), &body).await;
    for body in [
        json!({ "reason": REASON }),
        json!({ "reason": REASON, "confirm": "yes" }),
    ] {
        let problem = post(body).await.problem(409, "not-confirmed", words);
        assert_eq!(problem["confirm"], confirm);
    }
    for reason in ["", " ", &"x".repeat(501)] {
        post(json!({ "reason": reason, "confirm": confirm }))
            .await
            .problem(422, "invalid-content", &["reason", "1 to 500"]);
    }
    post(json!({ "confirm": confirm }))
        .await
        .problem(422, "invalid-content", &["reason"]);
    post(json!({ "reason": REASON, "confirm": confirm }))
        .await
        .json(200)
}

#[tokio::test]
async fn voided_evaluation_leaves_the_board_with_its_reason() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "a").await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    assert_eq!(board_teams(&site).await, json!(["Alpha"]));
    let words = [
        "Alpha",
        "2026-03-01",
        "disappear from the boards",
        "repeated",
    ];
    let voided = confirm_decision(&site, &format!("{path}/void"), "Alpha", &words).await;
    assert_eq!(
        voided["voided"],
        json!({ "at": "2026-03-01T10:00:00Z", "reason": REASON })
    );
    assert_eq!(voided["state"], "finished");
    assert_eq!(board_teams(&site).await, json!([]));
    let again = json!({ "reason": REASON, "confirm": "Alpha" });
    site.post(&format!("{path}/void"), Some(ADMIN), &again)
        .await
        .problem(409, "conflict", &["counting"]);
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(me["today"]["evaluation"], json!(null));
    let page = site.get(&path.replace("/api/v1", ""), None).await.body;
    assert!(
        page.contains("Voided") && page.contains("the &#60;table&#62; was tilted"),
        "{page}"
    );
    site.post(&format!("{path}/rerun"), Some(ADMIN), &json!({}))
        .await
        .json(201);
}

#[tokio::test]
async fn voided_day_voids_or_cancels_all_its_evaluations() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    let submission = site.valid_submission(&alpha, "a").await;
    site.valid_submission(&beta, "b").await;
    site.start_evaluation(&alpha, &submission).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/days/2026-03-01/void");
    let words = ["1 evaluation of 2026-03-01", "1 unfinished evaluation"];
    let day = confirm_decision(&site, &path, "2026-03-01", &words).await;
    let states: Vec<_> = day["created"]
        .as_array()
        .unwrap()
        .iter()
        .map(|evaluation| {
            (
                evaluation["state"].clone(),
                evaluation["voided"]["reason"].clone(),
            )
        })
        .collect();
    assert_eq!(
        states,
        [
            (json!("finished"), json!(REASON)),
            (json!("cancelled"), json!(null))
        ]
    );
    for wrong in ["2026-03-02", "yesterday"] {
        let path = format!("/api/v1/stages/{stage}/days/{wrong}/void");
        let body = json!({ "reason": REASON, "confirm": wrong });
        site.post(&path, Some(ADMIN), &body)
            .await
            .problem(404, "not-found", &["day"]);
    }
}

#[tokio::test]
async fn disqualified_team_leaves_the_board_with_the_reason() {
    let site = Site::start().await;
    let (team, submission, _) = site.team_with_evaluation("Alpha", "a").await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    site.next_day();
    let running = site.start_evaluation(&team, &submission).await;
    let path = format!("/api/v1/teams/{}/disqualify", team.id);
    let view = confirm_decision(
        &site,
        &path,
        "Alpha",
        &["Alpha", "all boards", "1 unfinished evaluation"],
    )
    .await;
    assert_eq!(view["disqualified"]["reason"], REASON);
    assert_eq!(board_teams(&site).await, json!([]));
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["disqualified"][0]["name"], "Alpha");
    let page = site.get("/", None).await.body;
    assert!(
        page.contains("Disqualified") && page.contains("the &#60;table&#62; was tilted"),
        "{page}"
    );
    let cancelled = site.get(&running, Some(&team.token)).await.json(200);
    assert_eq!(cancelled["state"], "cancelled");
    site.upload(&team.token, GZIP.to_vec()).await.problem(
        403,
        "disqualified",
        &["2026-03-02", "tilted", "reinstate"],
    );
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(
        me["team"]["disqualified"]["reason"], REASON,
        "the team can still read its data"
    );

    let path = format!("/api/v1/teams/{}/reinstate", team.id);
    let reinstated = site
        .post(&path, Some(ADMIN), &json!({ "reason": "a mistake" }))
        .await;
    assert_eq!(reinstated.json(200).get("disqualified"), None);
    assert_eq!(board_teams(&site).await, json!(["Alpha"]));
    site.post(&path, Some(ADMIN), &json!({ "reason": "a mistake" }))
        .await
        .problem(409, "conflict", &["not disqualified"]);
}

#[tokio::test]
async fn paused_queue_is_shown_and_server_stays_healthy() {
    let site = Site::start().await;
    let post = async |path: &str, body: Value| site.post(path, Some(ADMIN), &body).await;
    post("/api/v1/queue/pause", json!({ "reason": "" }))
        .await
        .problem(422, "invalid-content", &["reason"]);
    let paused = post("/api/v1/queue/pause", json!({ "reason": REASON })).await;
    assert_eq!(paused.status, 204);
    post("/api/v1/queue/pause", json!({ "reason": REASON }))
        .await
        .problem(409, "conflict", &["already"]);
    let pause = json!({ "at": "2026-03-01T10:00:00Z", "reason": REASON });
    assert_eq!(
        site.get("/api/v1/season", None).await.json(200)["paused"],
        pause
    );
    let health = site.get("/api/v1/health", None).await.json(200);
    assert_eq!(
        (&health["status"], &health["paused"]),
        (&json!("ok"), &pause)
    );
    for path in ["/", "/tasks/hit"] {
        let page = site.get(path, None).await.body;
        assert!(
            page.contains(
                "Paused</strong> since <time datetime=\"2026-03-01T10:00:00Z\">2026-03-01 10:00 UTC"
            ),
            "{page}"
        );
    }
    assert_eq!(post("/api/v1/queue/resume", json!({})).await.status, 204);
    post("/api/v1/queue/resume", json!({}))
        .await
        .problem(409, "conflict", &["not paused"]);
    assert_eq!(
        site.get("/api/v1/season", None)
            .await
            .json(200)
            .get("paused"),
        None
    );
    assert!(!site.get("/", None).await.body.contains("Paused"));
}

#[tokio::test]
async fn decisions_are_for_organisers_only() {
    let site = Site::start().await;
    let (team, _, evaluation) = site.team_with_evaluation("Alpha", "a").await;
    let stage = site.stage().await;
    for path in [
        format!("{evaluation}/void"),
        format!("/api/v1/stages/{stage}/days/2026-03-01/void"),
        format!("/api/v1/teams/{}/disqualify", team.id),
        format!("/api/v1/teams/{}/reinstate", team.id),
        "/api/v1/queue/pause".to_owned(),
        "/api/v1/queue/resume".to_owned(),
    ] {
        let body = json!({ "reason": REASON, "confirm": "Alpha" });
        site.post(&path, None, &body)
            .await
            .problem(401, "unauthenticated", &[]);
        site.post(&path, Some(&team.token), &body)
            .await
            .problem(403, "forbidden", &[]);
    }
}
