use crate::site::{ADMIN, GZIP, Site, result, text};
use serde_json::{Value, json};

const CLOSE: &str = "/api/v1/season/close";

#[tokio::test]
async fn closing_the_season_reveals_the_secret_and_ends_it_for_good() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    let path = site.evaluate(&team, &submission).await;
    let confirm = json!({ "confirm": "Test season" });
    let open = site.get("/api/v1/season", None).await.json(200);
    for field in ["closed_at", "secret", "mismatch_seed"] {
        assert_eq!(open[field], json!(null), "{field}");
    }
    site.post(CLOSE, Some(&team.token), &confirm)
        .await
        .problem(403, "forbidden", &[]);
    site.post(CLOSE, Some(ADMIN), &json!({ "confirm": "season" }))
        .await
        .problem(422, "invalid-content", &["Test season", "cannot be undone"]);
    site.post(CLOSE, Some(ADMIN), &confirm).await.problem(
        409,
        "conflict",
        &["1 evaluations", "cancel"],
    );
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;

    let closed = site.post(CLOSE, Some(ADMIN), &confirm).await.json(200);
    let season = site.get("/api/v1/season", Some(ADMIN)).await.json(200);
    assert_eq!(closed, season);
    assert_eq!(season["closed_at"], "2026-03-01T10:00:00Z");
    // The secret is the one that was committed to, and everything follows from it as documented.
    let secret: [u8; 32] = hex::decode(text(&season["secret"]))
        .unwrap()
        .try_into()
        .unwrap();
    assert_eq!(
        blake3::hash(&secret).to_hex().as_str(),
        text(&open["commitment"])
    );
    let child = |parent: &[u8; 32], label: &str, data: &[u8]| {
        let message = [label.as_bytes(), &[0], data].concat();
        blake3::keyed_hash(parent, &message)
    };
    let stage = site.stage().await;
    let of_stage = child(&secret, "stage", stage.as_uuid().as_bytes());
    let of_day = child(of_stage.as_bytes(), "day", b"2026-03-01");
    assert_eq!(season["days"][0]["day"], "2026-03-01");
    assert_eq!(season["days"][0]["finished"], 1);
    assert_eq!(season["days"][0]["cut_at"], "2026-03-01T10:00:00Z");
    assert_eq!(season["days"][0]["released_at"], "2026-03-01T10:00:00Z");
    assert_eq!(season["next_cut"], json!(null));
    assert_eq!(season["days"][0]["seed"], of_day.to_hex().as_str());
    let mismatch = child(&secret, "model_mismatch", b"");
    assert_eq!(season["mismatch_seed"], mismatch.to_hex().as_str());

    let over = ["2026-03-01 at 10:00 UTC"];
    site.post(CLOSE, Some(ADMIN), &confirm)
        .await
        .problem(409, "season-closed", &over);
    site.upload(&team.token, GZIP.to_vec())
        .await
        .problem(409, "season-closed", &over);
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "season-closed", &over);
    site.next_day();
    let choice = format!("{submission}/activate");
    site.post(&choice, Some(&team.token), &json!({}))
        .await
        .problem(409, "season-closed", &over);
    // What was reached stays.
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
async fn the_seasons_page_tells_a_sceptic_how_to_check() {
    let site = Site::start().await;
    let (early, late) = (site.team("Early").await, site.team("Late").await);
    let submission = site.valid_submission(&early, "e").await;
    site.valid_submission(&late, "l").await;
    site.evaluate(&early, &submission).await;
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    let season: Value = site.get("/api/v1/season", None).await.json(200);
    let commitment = text(&season["commitment"]);
    let page = |body: &str| {
        let html = scraper::Html::parse_document(body);
        assert!(html.errors.is_empty(), "{:?}\n{body}", html.errors);
    };
    let open = site.get("/season", None).await;
    assert_eq!(open.status, 200);
    page(&open.body);
    let verify = format!(
        "faceoff verify DATASET --secret SECRET --stage STAGE --day DAY --commitment {commitment}"
    );
    for part in [
        "Test season",
        "not yet",
        "held back",
        "model_mismatch",
        &verify,
    ] {
        assert!(open.body.contains(part), "{part:?} is not in {}", open.body);
    }
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    site.post(CLOSE, Some(ADMIN), &json!({ "confirm": "Test season" }))
        .await
        .json(200);
    let closed = site.get("/season", None).await;
    page(&closed.body);
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
