//! Tests of teams and their tokens.

use crate::site::{ADMIN, Site, string};
use serde_json::json;

#[tokio::test]
async fn team_token_is_shown_once_and_stored_as_a_hash() {
    let site = Site::start().await;
    let answer = site
        .post("/api/v1/teams", Some(ADMIN), &json!({ "name": "Zoë 1" }))
        .await;
    let team = answer.json(201);
    let token = string(&team["token"]);
    assert!(token.starts_with("fo_team_"));
    assert_eq!(answer.header("cache-control"), "no-store");

    let list = site.get("/api/v1/teams", Some(ADMIN)).await;
    assert_eq!(list.json(200)[0]["name"], "Zoë 1");
    assert!(!list.body.contains(&token));
    site.store.close().await;
    for file in ["faceoff.sqlite3", "faceoff.sqlite3-wal"] {
        if let Ok(bytes) = std::fs::read(site.folder.path().join(file)) {
            let is_found = bytes
                .windows(token.len())
                .any(|window| window == token.as_bytes());
            assert!(!is_found, "{file} contains the token in clear text");
        }
    }
}

#[tokio::test]
async fn team_token_gives_access_to_its_own_view() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(me["team"]["name"], "Alpha");
    assert_eq!(
        me["today"],
        json!({ "stage": site.stage().await, "day": "2026-03-01", "evaluation": null })
    );
    assert_eq!(me["active_submission"], json!(null));
    let next = &me["next_cutoff"];
    assert_eq!(
        (&next["day"], &next["at"]),
        (&json!("2026-03-01"), &json!(null))
    );
    assert_eq!(me["max_bundle_bytes"], crate::site::MAX_BUNDLE_BYTES);
}

#[tokio::test]
async fn new_token_revokes_the_old_one() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let path = format!("/api/v1/teams/{}/token", team.id);
    let replaced = site.post(&path, Some(ADMIN), &json!({})).await.json(200);
    let new_token = string(&replaced["token"]);
    assert_ne!(new_token, team.token);
    site.get("/api/v1/me", Some(&new_token)).await.json(200);
    site.get("/api/v1/me", Some(&team.token)).await.problem(
        401,
        "unauthenticated",
        &["replaced", "organiser"],
    );
    site.post(
        "/api/v1/teams/01890000-0000-7000-8000-000000000000/token",
        Some(ADMIN),
        &json!({}),
    )
    .await
    .problem(404, "not-found", &["team"]);
}

#[tokio::test]
async fn invalid_or_taken_team_name_is_refused_with_reason() {
    let site = Site::start().await;
    site.team("Alpha").await;
    let create = |name: &'static str| {
        let site = &site;
        async move {
            site.post("/api/v1/teams", Some(ADMIN), &json!({ "name": name }))
                .await
        }
    };
    create("Alpha")
        .await
        .problem(409, "team-name-taken", &["Alpha", "another name"]);
    create("alpha")
        .await
        .problem(409, "team-name-taken", &["Alpha"]);
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    assert_eq!(teams.as_array().unwrap().len(), 1);
    create("")
        .await
        .problem(422, "invalid-content", &["name", "1 to 40"]);
    create("<script>")
        .await
        .problem(422, "invalid-content", &["name", "'<'"]);
    create(" Alpha")
        .await
        .problem(422, "invalid-content", &["space"]);
    let long = "a".repeat(41);
    site.post("/api/v1/teams", Some(ADMIN), &json!({ "name": long }))
        .await
        .problem(422, "invalid-content", &["41"]);
    site.post(
        "/api/v1/teams",
        Some(ADMIN),
        &json!({ "name": "Beta", "admin": true }),
    )
    .await
    .problem(422, "invalid-content", &["admin"]);
}

#[tokio::test]
async fn missing_or_wrong_token_gets_an_explanation() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let new_team = json!({ "name": "Beta" });

    let without_token = site.post("/api/v1/teams", None, &new_team).await;
    without_token.problem(401, "unauthenticated", &["Authorization: Bearer"]);
    assert!(
        without_token
            .header("www-authenticate")
            .starts_with("Bearer")
    );
    for wrong in ["fo_team_wrong", "fo_admin_wrong", "x"] {
        site.post("/api/v1/teams", Some(wrong), &new_team)
            .await
            .problem(401, "unauthenticated", &[]);
    }
    site.post("/api/v1/teams", Some(&team.token), &new_team)
        .await
        .problem(403, "forbidden", &["organiser's token", "Alpha"]);
    site.get("/api/v1/me", Some(ADMIN))
        .await
        .problem(403, "forbidden", &["team's token"]);
    let basic = site
        .request(reqwest::Method::GET, "/api/v1/me", None)
        .basic_auth("team", Some(&team.token))
        .send()
        .await
        .unwrap();
    crate::site::Answer::read(basic)
        .await
        .problem(401, "unauthenticated", &["Bearer TOKEN"]);
}
