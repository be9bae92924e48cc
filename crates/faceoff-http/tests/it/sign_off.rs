//! Tests of the sign-off: the result of a stage is provisional until an organiser signs it off, and does not change after that.

use crate::site::{ADMIN, Site, result};
use serde_json::{Value, json};

#[tokio::test]
async fn signed_off_stage_does_not_change() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    let submission = site.valid_submission(&alpha, "a").await;
    site.valid_submission(&beta, "b").await;
    let path = site.start_evaluation(&alpha, &submission).await;
    let stage = site.stage().await.to_string();
    let sign_off_path = format!("/api/v1/stages/{stage}/finalise");
    let post_sign_off = async |body: Value| site.post(&sign_off_path, Some(ADMIN), &body).await;
    let confirmed = json!({ "confirm": "Qualifying" });
    post_sign_off(confirmed.clone()).await.problem(
        409,
        "conflict",
        &["has not closed", "no end yet"],
    );
    site.change_stage(&stage, json!({ "closes_at": "2026-03-01T12:00:00Z" }))
        .await
        .json(200);
    post_sign_off(confirmed.clone()).await.problem(
        409,
        "conflict",
        &["2026-03-01 at 12:00:00 UTC"],
    );
    site.advance(3 * 3600);
    post_sign_off(confirmed.clone()).await.problem(
        409,
        "conflict",
        &["2 evaluations", "wait until they are over"],
    );
    for score in [0.5, 0.6] {
        site.finish_evaluation(&result([score, 0.6, 0.7], 100.0))
            .await;
    }
    for body in [json!({}), json!({ "confirm": "qualifying" })] {
        let problem = post_sign_off(body).await.problem(
            409,
            "not-confirmed",
            &["Qualifying", "for good", "confirm"],
        );
        assert_eq!(problem["confirm"], "Qualifying");
    }
    post_sign_off(json!({ "confirm": 7 }))
        .await
        .problem(422, "invalid-content", &["confirm"]);
    post_sign_off(json!({ "name": "Qualifying" }))
        .await
        .problem(422, "invalid-content", &["name"]);
    for (token, status) in [(None, 401), (Some(alpha.token.as_str()), 403)] {
        assert_eq!(
            site.post(&sign_off_path, token, &confirmed)
                .await
                .status
                .as_u16(),
            status
        );
    }
    let unknown_stage = "/api/v1/stages/01890000-0000-7000-8000-000000000000/finalise";
    site.post(unknown_stage, Some(ADMIN), &confirmed)
        .await
        .problem(404, "not-found", &["stage"]);
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (&board["provisional"], &board["finalised"]),
        (&json!(true), &json!(null))
    );

    let signed_off = post_sign_off(confirmed.clone()).await.json(200);
    let sign_off = json!({ "at": "2026-03-01T13:00:00Z", "by": "organiser" });
    assert_eq!(signed_off["finalised"], sign_off);
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (&board["provisional"], &board["finalised"]),
        (&json!(false), &sign_off)
    );
    let page = site.get("/", None).await.body;
    assert!(
        page.contains("signed off on 2026-03-01 13:00 UTC by organiser"),
        "{page}"
    );
    assert!(site.get("/season", None).await.body.contains("signed off"));

    let words = ["signed off on 2026-03-01 at 13:00:00 UTC"];
    post_sign_off(confirmed)
        .await
        .problem(409, "conflict", &words);
    let void_evaluation = json!({ "reason": "why", "confirm": "Alpha" });
    site.post(&format!("{path}/void"), Some(ADMIN), &void_evaluation)
        .await
        .problem(409, "conflict", &words);
    let void_day = json!({ "reason": "why", "confirm": "2026-03-01" });
    let void_day_path = format!("/api/v1/stages/{stage}/days/2026-03-01/void");
    site.post(&void_day_path, Some(ADMIN), &void_day)
        .await
        .problem(409, "conflict", &words);
    for body in [
        json!({ "name": "Other" }),
        json!({ "publishes": "at_release" }),
        json!({ "closes_at": null }),
    ] {
        site.change_stage(&stage, body)
            .await
            .problem(409, "conflict", &words);
    }
    // A later disqualification has no effect on the signed-off result.
    let disqualification = json!({ "reason": "why", "confirm": "Beta" });
    site.post(
        &format!("/api/v1/teams/{}/disqualify", beta.id),
        Some(ADMIN),
        &disqualification,
    )
    .await
    .json(200);
    let after = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        after["rows"], board["rows"],
        "the signed-off board does not change"
    );
    assert_eq!(after["disqualified"], json!([]));
    let log = site
        .get("/api/v1/events?kind=stage_finalised", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(log["events"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn season_with_a_blind_stage_cannot_be_closed() {
    let site = Site::start().await;
    let stage = site.stage().await.to_string();
    site.change_stage(&stage, json!({ "blind": true }))
        .await
        .json(200);
    let close = json!({ "confirm": "Test season" });
    site.post("/api/v1/season/close", Some(ADMIN), &close)
        .await
        .problem(
            409,
            "conflict",
            &["Qualifying", "blind", "set `blind` to false first"],
        );
    site.change_stage(&stage, json!({ "blind": false }))
        .await
        .json(200);
    site.post("/api/v1/season/close", Some(ADMIN), &close)
        .await
        .json(200);
    let sign_off_path = format!("/api/v1/stages/{stage}/finalise");
    let confirmed = json!({ "confirm": "Qualifying" });
    // The stage had no end of its own, so it closed with the season.
    let signed_off = site
        .post(&sign_off_path, Some(ADMIN), &confirmed)
        .await
        .json(200);
    assert_eq!(signed_off["finalised"]["by"], "organiser");
}
