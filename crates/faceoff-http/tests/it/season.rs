//! Tests of the season's end, which reveals the secret from which all seeds derive, and of the page that explains how to verify
//! the seeds.

use crate::site::{ADMIN, GZIP, Site, result, string};
use serde_json::{Value, json};

const CLOSE_PATH: &str = "/api/v1/season/close";

#[tokio::test]
async fn closing_the_season_reveals_its_secret() {
    let site = Site::start().await;
    let (team, submission, path) = site.team_with_evaluation("Alpha", "a").await;
    let confirm = json!({ "confirm": "Test season" });
    let open = site.get("/api/v1/season", None).await.json(200);
    for field in ["closed_at", "secret", "mismatch_seed"] {
        assert_eq!(open[field], json!(null), "{field}");
    }
    site.post(CLOSE_PATH, Some(&team.token), &confirm)
        .await
        .problem(403, "forbidden", &[]);
    site.post(CLOSE_PATH, Some(ADMIN), &json!({ "confirm": "season" }))
        .await
        .problem(422, "invalid-content", &["Test season", "cannot be undone"]);
    site.post(CLOSE_PATH, Some(ADMIN), &confirm).await.problem(
        409,
        "conflict",
        &["1 evaluations", "cancel"],
    );
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;

    let closed = site.post(CLOSE_PATH, Some(ADMIN), &confirm).await.json(200);
    let season = site.get("/api/v1/season", Some(ADMIN)).await.json(200);
    assert_eq!(closed, season);
    assert_eq!(season["closed_at"], "2026-03-01T10:00:00Z");
    // The secret matches the commitment, and all seeds are derived from it as documented.
    let secret: [u8; 32] = hex::decode(string(&season["secret"]))
        .unwrap()
        .try_into()
        .unwrap();
    assert_eq!(
        blake3::hash(&secret).to_hex().as_str(),
        string(&open["commitment"])
    );
    let derive = |parent: &[u8; 32], label: &str, data: &[u8]| {
        let message = [label.as_bytes(), &[0], data].concat();
        blake3::keyed_hash(parent, &message)
    };
    let stage = site.stage().await;
    let stage_seed = derive(&secret, "stage", stage.as_uuid().as_bytes());
    let day_seed = derive(stage_seed.as_bytes(), "day", b"2026-03-01");
    assert_eq!(season["days"][0]["day"], "2026-03-01");
    assert_eq!(season["days"][0]["finished"], 1);
    assert_eq!(season["days"][0]["cutoff_at"], "2026-03-01T10:00:00Z");
    assert_eq!(season["days"][0]["released_at"], "2026-03-01T10:00:00Z");
    assert_eq!(season["next_cutoff"], json!(null));
    assert_eq!(season["days"][0]["seed"], day_seed.to_hex().as_str());
    let mismatch_seed = derive(&secret, "model_mismatch", b"");
    assert_eq!(season["mismatch_seed"], mismatch_seed.to_hex().as_str());

    let closed_words = ["2026-03-01 at 10:00 UTC"];
    site.post(CLOSE_PATH, Some(ADMIN), &confirm)
        .await
        .problem(409, "season-closed", &closed_words);
    site.upload(&team.token, GZIP.to_vec())
        .await
        .problem(409, "season-closed", &closed_words);
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "season-closed", &closed_words);
    site.post("/api/v1/stages", Some(ADMIN), &json!({ "name": "Late" }))
        .await
        .problem(409, "season-closed", &closed_words);
    site.next_day();
    let activate = format!("{submission}/activate");
    site.post(&activate, Some(&team.token), &json!({}))
        .await
        .problem(409, "season-closed", &closed_words);
    // Results and datasets stay available.
    assert_eq!(
        site.get(&format!("{path}/dataset"), Some(&team.token))
            .await
            .status,
        200
    );
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"].as_array().map(Vec::len), Some(1));
}

#[tokio::test]
async fn season_page_explains_how_to_verify_seeds() {
    let site = Site::start().await;
    let (early, late) = (site.team("Early").await, site.team("Late").await);
    let submission = site.valid_submission(&early, "e").await;
    site.valid_submission(&late, "l").await;
    site.start_evaluation(&early, &submission).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let season: Value = site.get("/api/v1/season", None).await.json(200);
    let commitment = string(&season["commitment"]);
    // One evaluation is still queued, so the day's seed is not public yet.
    let open = site.get("/season", None).await;
    open.html(200);
    let verify = format!(
        "faceoff verify DATASET --secret SECRET --stage STAGE --day DAY --commitment {commitment}"
    );
    for part in [
        "Test season",
        "not yet",
        "published at release",
        "model_mismatch",
        &verify,
    ] {
        assert!(open.body.contains(part), "{part:?} is not in {}", open.body);
    }
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    site.post(
        CLOSE_PATH,
        Some(ADMIN),
        &json!({ "confirm": "Test season" }),
    )
    .await
    .json(200);
    let closed = site.get("/season", None).await;
    closed.html(200);
    let secret = site.store.season().await.unwrap().secret;
    let day = secret
        .stage(site.stage().await)
        .day(jiff::civil::date(2026, 3, 1));
    for part in [
        format!("--secret {secret}"),
        day.to_string(),
        secret.model_mismatch().to_string(),
        "2026-03-01 10:00:00 UTC".to_owned(),
    ] {
        assert!(
            closed.body.contains(&part),
            "{part:?} is not in {}",
            closed.body
        );
    }
    let board = site.get("/", None).await.body;
    assert!(board.contains("href=\"/season\"") && board.contains(&commitment));
}
