//! Trials and re-evaluations over HTTP.

use crate::site::{ADMIN, Site, outcome, text};
use faceoff_types::Task;
use serde_json::{Value, json};

const WHY: &str = "the camera was dirty";

/// Solves the first so many of four episodes of each task.
fn solves(count: u32) -> impl Fn(Task, u32) -> faceoff_types::EpisodeOutcome {
    move |task, episode| faceoff_types::EpisodeOutcome {
        success: episode < count,
        ..outcome(task, episode, false)
    }
}

/// A released day on which Alpha solved three of four and Beta two.
async fn played(site: &Site) -> [String; 2] {
    let [three, two] = [solves(3), solves(2)];
    let ids = site
        .played_day(4, [("Alpha", &three), ("Beta", &two)])
        .await;
    ids.map(|id| id.to_string())
}

async fn post(site: &Site, path: &str, body: Value) -> crate::site::Answer {
    site.post(path, Some(ADMIN), &body).await
}

async fn ranks(site: &Site) -> Vec<String> {
    let board = site.get("/api/v1/board", None).await.json(200);
    let rows = board["rows"].as_array().unwrap().iter();
    rows.map(|row| text(&row["team"])).collect()
}

#[tokio::test]
async fn a_day_is_tried_and_only_the_organiser_sees_it() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/trial");
    let wanted = json!({ "reason": WHY });
    post(&site, &path, wanted.clone()).await.problem(
        409,
        "conflict",
        &["no team has a valid submission"],
    );
    let submission = site.valid_submission(&alpha, "a").await;
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(alpha.token.as_str()), 403, "forbidden"),
    ] {
        site.post(&path, token, &wanted)
            .await
            .problem(status, slug, &[]);
        site.get("/api/v1/proposals", token)
            .await
            .problem(status, slug, &[]);
    }
    for (wrong, words) in [
        (json!({}), "reason"),
        (json!({ "reason": "" }), "reason"),
        (json!({ "reason": WHY, "submission": "mine" }), "submission"),
        (json!({ "reason": WHY, "day": "2026-03-01" }), "day"),
    ] {
        post(&site, &path, wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    let nobodys = json!({ "reason": WHY, "submission": uuid::Uuid::nil() });
    post(&site, &path, nobodys)
        .await
        .problem(404, "not-found", &["submission"]);
    let nowhere = format!("/api/v1/stages/{}/trial", uuid::Uuid::nil());
    post(&site, &nowhere, wanted.clone())
        .await
        .problem(404, "not-found", &["stage"]);

    let id = submission.rsplit('/').next().unwrap();
    let trial = post(&site, &path, json!({ "reason": WHY, "submission": id }))
        .await
        .json(201);
    assert_eq!(
        (&trial["kind"], &trial["state"], &trial["day"]),
        (&json!("trial"), &json!("playing"), &Value::Null)
    );
    assert_eq!(trial["evaluations"][0]["state"], "queued");
    let own = format!("/api/v1/proposals/{}", text(&trial["id"]));
    site.get(&own, Some(&alpha.token))
        .await
        .problem(403, "forbidden", &[]);
    let evaluation = site.finish_as(solves(4)).await;
    let done = site.get(&own, Some(ADMIN)).await.json(200);
    assert_eq!(
        (&done["state"], &done["evaluations"][0]["state"]),
        (&json!("played"), &json!("finished"))
    );
    assert_eq!(done["evaluations"][0]["result"]["score"], 100.0);
    assert_eq!(done["outcome"]["new_board"]["rows"][0]["team"], "Alpha");
    assert_eq!(
        (&done["outcome"]["old_board"], &done["outcome"]["changes"]),
        (&Value::Null, &json!([]))
    );

    // Nobody else: not its team, no board, no page, no turn.
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["turn"]["evaluation"], Value::Null);
    assert_eq!(
        site.get("/api/v1/evaluations", Some(&alpha.token))
            .await
            .json(200),
        json!([])
    );
    site.get(
        &format!("/api/v1/evaluations/{evaluation}"),
        Some(&alpha.token),
    )
    .await
    .problem(404, "not-found", &[]);
    assert_eq!(
        site.get(&format!("/evaluations/{evaluation}"), None)
            .await
            .status,
        404
    );
    assert!(ranks(&site).await.is_empty());
    assert_eq!(
        site.get("/api/v1/season", None).await.json(200)["days"],
        json!([])
    );

    post(&site, &format!("{own}/apply"), json!({}))
        .await
        .problem(409, "conflict", &["nothing to apply"]);
    post(&site, &format!("{own}/drop"), json!({}))
        .await
        .problem(409, "not-confirmed", &["would never count", "Qualifying"]);
    let confirmed = json!({ "confirm": "Qualifying" });
    let dropped = post(&site, &format!("{own}/drop"), confirmed)
        .await
        .json(200);
    assert_eq!(dropped["state"], "dropped");
    post(&site, &format!("{own}/drop"), json!({}))
        .await
        .problem(409, "conflict", &["was dropped"]);
    let list = site.get("/api/v1/proposals", Some(ADMIN)).await.json(200);
    assert_eq!(
        (&list[0]["id"], &list[0]["evaluations"]),
        (&trial["id"], &Value::Null)
    );
}

#[tokio::test]
async fn a_re_evaluation_shows_which_ranks_would_change_and_changes_them_when_it_is_applied() {
    let site = Site::start().await;
    let [of_alpha, of_beta] = played(&site).await;
    assert_eq!(ranks(&site).await, ["Alpha", "Beta"]);
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let made = post(&site, &path, json!({ "day": "2026-03-01", "reason": WHY }))
        .await
        .json(201);
    let own = format!("/api/v1/proposals/{}", text(&made["id"]));
    let apply = format!("{own}/apply");
    post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .problem(
            409,
            "conflict",
            &["2 of its evaluations are queued or running"],
        );
    // This time Alpha solves one, Beta two as before.
    site.finish_as(solves(1)).await;
    assert_eq!(
        site.get(&own, Some(ADMIN)).await.json(200)["outcome"],
        Value::Null
    );
    site.finish_as(solves(2)).await;
    assert_eq!(ranks(&site).await, ["Alpha", "Beta"], "nothing has changed");

    let seen = site.get(&own, Some(ADMIN)).await.json(200);
    assert_eq!(
        (&seen["kind"], &seen["state"]),
        (&json!("day"), &json!("played"))
    );
    let replaced: Vec<_> = seen["evaluations"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| text(&one["replaces"]))
        .collect();
    assert_eq!(replaced, [of_alpha.clone(), of_beta.clone()]);
    let outcome = &seen["outcome"];
    let teams = |board: &Value| -> Vec<String> {
        let rows = board["rows"].as_array().unwrap().iter();
        rows.map(|row| text(&row["team"])).collect()
    };
    assert_eq!(teams(&outcome["old_board"]), ["Alpha", "Beta"]);
    assert_eq!(teams(&outcome["new_board"]), ["Beta", "Alpha"]);
    let standing = |rank: u32, score: f64| json!({ "rank": rank, "tier": "deployable", "score": score, "penalty_points": 0.0 });
    assert_eq!(
        outcome["changes"],
        json!([
            { "team": "Beta", "old": standing(2, 50.0), "new": standing(1, 50.0) },
            { "team": "Alpha", "old": standing(1, 75.0), "new": standing(2, 25.0) },
        ])
    );

    for unconfirmed in [json!({}), json!({ "confirm": "2026-03-02" })] {
        let problem = post(&site, &apply, unconfirmed).await.problem(
            409,
            "not-confirmed",
            &["2 evaluations of 2026-03-01", "2 another rank", WHY],
        );
        assert_eq!(problem["confirm"], "2026-03-01");
    }
    assert_eq!(ranks(&site).await, ["Alpha", "Beta"]);
    let applied = post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .json(200);
    assert_eq!(
        (&applied["state"], &applied["outcome"]),
        (&json!("applied"), &Value::Null)
    );
    assert_eq!(ranks(&site).await, ["Beta", "Alpha"]);
    let old = site
        .get(&format!("/api/v1/evaluations/{of_alpha}"), Some(ADMIN))
        .await
        .json(200);
    assert_eq!(old["voided"]["reason"], format!("evaluated again: {WHY}"));
    let board = site.get("/api/v1/board", None).await.json(200);
    let new = text(&board["rows"][1]["evaluation"]);
    assert_eq!(json!(new), seen["evaluations"][0]["evaluation"]);
    let view = site
        .get(&format!("/api/v1/evaluations/{new}"), Some(ADMIN))
        .await
        .json(200);
    assert_eq!(
        (&view["rerun_of"], &view["state"]),
        (&json!(of_alpha), &json!("finished"))
    );
    post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .problem(409, "conflict", &["was applied"]);
}

#[tokio::test]
async fn what_cannot_be_evaluated_again_is_refused_with_what_can() {
    let site = Site::start().await;
    let [of_alpha, _] = played(&site).await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let team = site.team("Gamma").await;
    let wanted = json!({ "day": "2026-03-01", "reason": WHY });
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(team.token.as_str()), 403, "forbidden"),
    ] {
        site.post(&path, token, &wanted)
            .await
            .problem(status, slug, &[]);
        for what in ["apply", "drop"] {
            let path = format!("/api/v1/proposals/{}/{what}", uuid::Uuid::nil());
            site.post(&path, token, &json!({}))
                .await
                .problem(status, slug, &[]);
        }
    }
    for (wrong, words) in [
        (json!({ "day": "2026-03-01" }), "reason"),
        (json!({ "reason": WHY }), "either"),
        (
            json!({ "day": "2026-03-01", "evaluation": of_alpha, "reason": WHY }),
            "either",
        ),
        (
            json!({ "evaluation": of_alpha, "new_rules": true, "reason": WHY }),
            "whole day",
        ),
        (json!({ "day": "yesterday", "reason": WHY }), "day"),
        (json!({ "day": "2026-03-01", "reason": "" }), "reason"),
        (
            json!({ "day": "2026-03-01", "reason": WHY, "new_rules": "yes" }),
            "new_rules",
        ),
    ] {
        post(&site, &path, wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    post(&site, &path, json!({ "day": "2026-03-02", "reason": WHY }))
        .await
        .problem(404, "not-found", &["day"]);
    post(
        &site,
        &path,
        json!({ "evaluation": uuid::Uuid::nil(), "reason": WHY }),
    )
    .await
    .problem(404, "not-found", &["evaluation"]);
    let other = post(&site, "/api/v1/stages", json!({ "name": "Final" }))
        .await
        .json(201);
    let elsewhere = format!("/api/v1/stages/{}/proposals", text(&other["id"]));
    post(
        &site,
        &elsewhere,
        json!({ "evaluation": of_alpha, "reason": WHY }),
    )
    .await
    .problem(404, "not-found", &["in this stage"]);
    post(
        &site,
        &path,
        json!({ "day": "2026-03-01", "new_rules": true, "reason": WHY }),
    )
    .await
    .problem(409, "conflict", &["newest rules"]);
    for what in ["", "/apply", "/drop"] {
        let path = format!("/api/v1/proposals/{}{what}", uuid::Uuid::nil());
        let answer = match what {
            "" => site.get(&path, Some(ADMIN)).await,
            _ => post(&site, &path, json!({})).await,
        };
        answer.problem(404, "not-found", &["proposal"]);
    }
    assert_eq!(
        site.get("/api/v1/proposals", Some(ADMIN)).await.json(200),
        json!([])
    );
}

#[tokio::test]
async fn a_day_by_other_rules_is_a_board_of_its_own() {
    let site = Site::start().await;
    played(&site).await;
    let stage = site.stage().await;
    let request = site.request(
        reqwest::Method::PATCH,
        &format!("/api/v1/stages/{stage}"),
        Some(ADMIN),
    );
    let rules = json!({ "max_faults": 3, "confirm": "Qualifying" });
    assert_eq!(request.json(&rules).send().await.unwrap().status(), 200);
    let path = format!("/api/v1/stages/{stage}/proposals");
    let wanted = json!({ "day": "2026-03-01", "new_rules": true, "reason": WHY });
    let made = post(&site, &path, wanted).await.json(201);
    site.finish_as(solves(1)).await;
    site.finish_as(solves(4)).await;
    let own = format!("/api/v1/proposals/{}", text(&made["id"]));
    let seen = site.get(&own, Some(ADMIN)).await.json(200);
    let outcome = &seen["outcome"];
    let newest = seen["revision"].as_u64().unwrap();
    assert_eq!(outcome["old_board"]["revision"], json!(newest - 1));
    assert_eq!(outcome["new_board"]["revision"], json!(newest));
    assert_eq!(outcome["changes"].as_array().unwrap().len(), 2);
    post(
        &site,
        &format!("{own}/apply"),
        json!({ "confirm": "2026-03-01" }),
    )
    .await
    .json(200);
    assert_eq!(ranks(&site).await, ["Beta", "Alpha"]);
    let old = format!("/api/v1/board?stage={stage}&revision={}", newest - 1);
    let old = site.get(&old, None).await.json(200);
    assert_eq!(
        old["rows"][0]["team"], "Alpha",
        "the board of the old rules stays"
    );
}

#[tokio::test]
async fn what_a_proposal_has_played_is_the_organisers_to_download_until_it_is_dropped() {
    let site = Site::start().await;
    played(&site).await;
    let stage = site.stage().await;
    let gamma = site.team("Gamma").await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let wanted = json!({ "day": "2026-03-01", "reason": WHY });
    let made = post(&site, &path, wanted).await.json(201);
    let own = format!("/api/v1/proposals/{}", text(&made["id"]));
    let dataset_of = |proposal: &Value, place: usize| {
        let id = text(&proposal["evaluations"][place]["evaluation"]);
        format!("/api/v1/evaluations/{id}/dataset")
    };
    let [first, second] = [dataset_of(&made, 0), dataset_of(&made, 1)];
    site.get(&first, Some(ADMIN))
        .await
        .problem(409, "conflict", &["is not finished", &own]);
    site.finish_as(solves(1)).await;
    site.play_shards(4).await;

    let seen = site.get(&own, Some(ADMIN)).await.json(200);
    let finished = &seen["evaluations"][0];
    assert_eq!(text(&finished["dataset"]), first);
    let download = site.get(&first, Some(ADMIN)).await;
    assert_eq!(
        (download.status.as_u16(), download.header("content-type")),
        (200, "application/zip")
    );
    assert!(
        download
            .header("content-disposition")
            .contains("faceoff-Alpha-2026-03-01.zip"),
        "{download:?}"
    );
    assert!(download.body.starts_with("PK"));
    let hash = blake3::hash(download.body.as_bytes()).to_hex().to_string();
    assert_eq!(text(&finished["dataset_blake3"]), hash);
    site.get(&second, Some(ADMIN))
        .await
        .problem(409, "conflict", &["the agent failed too often"]);
    // For others, its team among them, there is none.
    let alpha = text(&seen["evaluations"][0]["team"]);
    let token = format!("/api/v1/teams/{alpha}/token");
    let token = post(&site, &token, json!({})).await.json(200);
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(gamma.token.as_str()), 404, "not-found"),
        (token["token"].as_str(), 404, "not-found"),
    ] {
        site.get(&first, token).await.problem(status, slug, &[]);
    }

    // Applied, it is where it was, as any evaluation's: its team's, too.
    post(
        &site,
        &format!("{own}/apply"),
        json!({ "confirm": "2026-03-01" }),
    )
    .await
    .json(200);
    for token in [Some(ADMIN), token["token"].as_str()] {
        assert_eq!(site.get(&first, token).await.status, 200);
    }
    site.get(&first, Some(&gamma.token))
        .await
        .problem(404, "not-found", &[]);

    // Dropped, it is gone at once.
    let trial = format!("/api/v1/stages/{stage}/trial");
    let wanted = json!({ "reason": WHY, "submission": seen["evaluations"][0]["submission"] });
    let trial = post(&site, &trial, wanted).await.json(201);
    site.finish_as(solves(2)).await;
    let of_trial = dataset_of(&trial, 0);
    assert_eq!(site.get(&of_trial, Some(ADMIN)).await.status, 200);
    let own = format!("/api/v1/proposals/{}", text(&trial["id"]));
    let confirmed = json!({ "confirm": "Qualifying" });
    let dropped = post(&site, &format!("{own}/drop"), confirmed)
        .await
        .json(200);
    let finished = &dropped["evaluations"][0];
    assert_eq!(
        (
            &finished["state"],
            &finished["dataset"],
            &finished["dataset_blake3"]
        ),
        (&json!("finished"), &Value::Null, &Value::Null)
    );
    for _ in ["before and", "after its removal"] {
        site.get(&of_trial, Some(ADMIN))
            .await
            .problem(410, "gone", &["was dropped at", &own]);
        site.store
            .remove_dropped_datasets(site.now())
            .await
            .unwrap();
    }
    site.get(&of_trial, Some(&gamma.token))
        .await
        .problem(404, "not-found", &[]);
}
