//! Tests of retention (a stage's rule that says which datasets and bundles are kept), of deleted submissions, and of disk usage.

use crate::site::{ADMIN, Answer, DATASET, GZIP, Site, TestTeam, invalid_outcome, result, string};
use reqwest::Method;
use serde_json::{Value, json};

/// The first stage, as visitors see it.
async fn stage_view(site: &Site) -> Value {
    let path = format!("/api/v1/stages/{}", site.stage().await);
    site.get(&path, None).await.json(200)
}

/// Runs an evaluation day with this submission, which gets these success rates in the three tasks. Returns the API path of its
/// evaluation. The clock is then on the next day.
async fn run_day(site: &Site, team: &TestTeam, submission: &str, rates: [f64; 3]) -> String {
    let evaluation = site.start_evaluation(team, submission).await;
    site.finish_evaluation(&result(rates, 10.0)).await;
    site.next_day();
    evaluation
}

/// Deletes a submission.
async fn delete(site: &Site, submission: &str, token: Option<&str>, body: Value) -> Answer {
    site.send(Method::DELETE, submission, token, &body).await
}

#[tokio::test]
async fn retention_is_confirmed_applied_and_reported() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    let mut evaluations = Vec::new();
    for rate in [0.9, 0.1, 0.2] {
        evaluations.push(run_day(&site, &team, &submission, [rate; 3]).await);
    }
    // The first evaluation is the best one, the third one the last. So this retention removes the dataset of the second one.
    let before = stage_view(&site).await;
    assert_eq!(before["retention"], json!({}));
    let request = json!({ "retention": { "last": 1 } });
    let unconfirmed = site.change_first_stage(request).await;
    let problem = unconfirmed.problem(
        409,
        "not-confirmed",
        &[
            "nothing is done yet",
            "the last 1 and the best of each team",
            "1 datasets of 1 teams and 0 bundles",
            &format!("{} bytes", DATASET.len()),
        ],
    );
    assert_eq!(problem["confirm"], "Qualifying");
    assert_eq!(stage_view(&site).await, before);
    let confirmed = json!({ "retention": { "last": 1 }, "confirm": "Qualifying" });
    let changed = site.change_first_stage(confirmed).await.json(200);
    assert_eq!(changed["retention"], json!({ "last": 1 }));
    assert_eq!(
        changed["revision"], before["revision"],
        "retention is not a rule"
    );
    let dataset = format!("{}/dataset", evaluations[1]);
    assert_eq!(site.get(&dataset, Some(&team.token)).await.status, 200);
    let removed = site.store.apply_retentions(site.now()).await.unwrap();
    assert_eq!(removed.datasets, 1);

    let violations = format!("{}/violations", evaluations[1]);
    let check_removed = async |path: &str, token: &str| {
        let problem = site.get(path, Some(token)).await.problem(
            410,
            "removed",
            &[
                "was removed on 2026-03-04",
                "the retention of the stage \"Qualifying\"",
                "the last 1 and the best of each team",
            ],
        );
        assert!(string(&problem["removed_at"]).starts_with("2026-03-04"));
    };
    for path in [&dataset, &violations] {
        check_removed(path, &team.token).await;
    }
    // Organisers can still download the dataset while the file exists, since it may be evidence.
    assert_eq!(site.get(&dataset, Some(ADMIN)).await.status, 200);
    for retained in [&evaluations[0], &evaluations[2]] {
        let path = format!("{retained}/dataset");
        let answer = site.get(&path, Some(&team.token)).await;
        assert_eq!(answer.status, 200, "{}", answer.body);
    }
    // Callers without access do not learn that the dataset existed.
    site.get(&dataset, None)
        .await
        .problem(401, "unauthenticated", &[]);
    let view = site.get(&evaluations[1], Some(&team.token)).await.json(200);
    assert_eq!(view["state"], "finished");
    assert_eq!(view["dataset"], Value::Null);
    assert!(view["result"]["score"].is_number(), "its result stays");
    assert!(string(&view["dataset_removed"]["reason"]).contains("the last 1"));
    assert!(string(&view["next"]).contains("the dataset was removed"));
    let page = evaluations[1].replace("/api/v1", "");
    let page = site.get(&page, None).await;
    assert_eq!(page.status, 200);
    assert!(
        page.body.contains("removed on <time datetime=\"2026-03-04"),
        "{}",
        page.body
    );
    assert!(
        !page.body.contains("/dataset\""),
        "the removed dataset is not linked"
    );

    // Keeping more removes nothing, so no confirmation is needed.
    let changed = site
        .change_first_stage(json!({ "retention": {} }))
        .await
        .json(200);
    assert_eq!(changed["retention"], json!({}));

    // The file of a removed dataset is deleted a day later, also for organisers.
    site.next_day();
    let removed = site.store.remove_files_of_removed(site.now()).await;
    assert_eq!(removed.unwrap(), 1);
    check_removed(&dataset, ADMIN).await;
}

#[tokio::test]
async fn retention_is_set_at_creation_and_after_sign_off() {
    let site = Site::start().await;
    let created = site
        .post(
            "/api/v1/stages",
            Some(ADMIN),
            &json!({ "name": "Warm-up", "retention": { "last": 2 } }),
        )
        .await
        .json(201);
    assert_eq!(created["retention"], json!({ "last": 2 }));
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "a").await;
    let evaluation = run_day(&site, &team, &submission, [0.5; 3]).await;
    let closes_at = site.now() + jiff::SignedDuration::from_hours(1);
    site.change_first_stage(json!({ "closes_at": closes_at }))
        .await
        .json(200);
    site.advance(3600);
    let path = format!("/api/v1/stages/{}/finalise", site.stage().await);
    site.post(&path, Some(ADMIN), &json!({ "confirm": "Qualifying" }))
        .await
        .json(200);
    let mut request = json!({ "retention": { "days_after_sign_off": 2 } });
    site.change_first_stage(request.clone()).await.problem(
        409,
        "not-confirmed",
        &["1 datasets", "not before 2026-03-04 at 11:00 UTC"],
    );
    request["confirm"] = json!("Qualifying");
    let signed_off = site.change_first_stage(request).await.json(200);
    assert_eq!(signed_off["retention"], json!({ "days_after_sign_off": 2 }));
    site.change_first_stage(json!({ "name": "Other", "retention": {} }))
        .await
        .problem(409, "conflict", &["signed off"]);
    assert_eq!(
        stage_view(&site).await["retention"],
        signed_off["retention"]
    );
    site.next_day();
    site.next_day();
    let removed = site.store.apply_retentions(site.now()).await.unwrap();
    assert_eq!(removed.datasets, 1);
    site.get(&format!("{evaluation}/dataset"), Some(&team.token))
        .await
        .problem(410, "removed", &["2 days after the sign-off"]);
    let board = format!("/api/v1/board?stage={}", site.stage().await);
    let board = site.get(&board, None).await.json(200);
    assert_eq!(board["rows"][0]["team"], "Alpha", "its result stays");
}

#[tokio::test]
async fn invalid_retention_is_refused_with_valid_values() {
    let site = Site::start().await;
    for (wrong, words) in [
        (json!({ "last": 0 }), "expected 1 to 1000, got 0"),
        (json!({ "last": 1001 }), "expected 1 to 1000, got 1001"),
        (json!({ "last": -1 }), "retention.last"),
        (json!({ "last": 4_294_967_296_u64 }), "retention.last"),
        (json!({ "last": "five" }), "retention.last"),
        (json!({ "last": 1.5 }), "retention.last"),
        (json!({ "days_after_sign_off": 0 }), "expected 1 to 3650"),
        (json!({ "days_after_sign_off": 3651 }), "expected 1 to 3650"),
        (json!({ "until": "soon" }), "retention.until"),
        (json!({ "newest": 5 }), "newest"),
        (json!("all"), "retention"),
        (
            json!({ "until": "2027-01-01T00:00:00Z", "days_after_sign_off": 3 }),
            "one of them at most",
        ),
    ] {
        let changed = site.change_first_stage(json!({ "retention": wrong })).await;
        changed.problem(422, "invalid-content", &[words]);
        let new_stage = json!({ "name": "Other", "retention": wrong });
        let refused = site.post("/api/v1/stages", Some(ADMIN), &new_stage).await;
        refused.problem(422, "invalid-content", &[words]);
    }
    assert_eq!(stage_view(&site).await["retention"], json!({}));
    let stages = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(stages.as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn unchecked_or_invalid_submission_cannot_be_deleted() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let uploaded = site.upload(&team.token, GZIP.to_vec()).await.json(201);
    let submission = format!("/api/v1/submissions/{}", string(&uploaded["id"]));
    let delete_it = async |submission: &str| {
        let request = json!({ "confirm": "striker.tar.gz", "reason": "a mistake" });
        delete(&site, submission, Some(ADMIN), request).await
    };
    delete_it(&submission)
        .await
        .problem(409, "conflict", &["validation run is queued or running"]);
    site.finish_validation(invalid_outcome("no manifest", ""))
        .await;
    delete_it(&submission)
        .await
        .problem(409, "conflict", &["removes its bundle automatically"]);
    site.store
        .clean_up_failed_submissions(site.now())
        .await
        .unwrap();
    delete_it(&submission)
        .await
        .problem(409, "conflict", &["nothing left to delete"]);
    let unknown = format!("/api/v1/submissions/{}", uuid::Uuid::nil());
    delete_it(&unknown)
        .await
        .problem(404, "not-found", &["submission"]);
}

#[tokio::test]
async fn deleted_submission_keeps_its_results() {
    let site = Site::start().await;
    let (team, other) = (site.team("Alpha").await, site.team("Beta").await);
    let submission = site.valid_submission(&team, "a").await;
    let evaluation = run_day(&site, &team, &submission, [0.5; 3]).await;
    let team_token = Some(team.token.as_str());
    let bundle = format!("{submission}/bundle");
    let downloaded = site.get(&bundle, team_token).await;
    assert_eq!(downloaded.status, 200);
    assert_eq!(downloaded.body, String::from_utf8_lossy(&GZIP));
    let disposition = downloaded.header("content-disposition");
    assert!(disposition.ends_with(".tar.gz\""), "{disposition}");

    // The active submission cannot be deleted. The second one becomes active instead.
    delete(&site, &submission, team_token, json!({}))
        .await
        .problem(409, "conflict", &["active", "withdraw"]);
    site.valid_submission(&team, "b").await;
    for (wrong, status, slug, words) in [
        (
            json!({}),
            409,
            "not-confirmed",
            ["nothing is done yet", "for good"],
        ),
        (
            json!({ "confirm": "Alpha" }),
            409,
            "not-confirmed",
            ["striker.tar.gz", "results stay"],
        ),
        (
            json!({ "confirm": 7 }),
            422,
            "invalid-content",
            ["confirm", "string"],
        ),
        (
            json!({ "reason": "", "confirm": "striker.tar.gz" }),
            422,
            "invalid-content",
            ["reason", "1 to 500"],
        ),
        (
            json!({ "confirmed": "striker.tar.gz" }),
            422,
            "invalid-content",
            ["confirmed", "unknown field"],
        ),
    ] {
        let refused = delete(&site, &submission, team_token, wrong).await;
        refused.problem(status, slug, &words);
    }
    let confirm = json!({ "confirm": "striker.tar.gz" });
    delete(&site, &submission, Some(&other.token), confirm.clone())
        .await
        .problem(404, "not-found", &[]);
    delete(&site, &submission, Some(ADMIN), confirm.clone())
        .await
        .problem(422, "invalid-content", &["reason", "1 to 500"]);
    assert_eq!(site.get(&bundle, team_token).await.status, 200);

    let deleted = delete(&site, &submission, team_token, confirm.clone())
        .await
        .json(200);
    assert_eq!(deleted["state"], "valid");
    assert_eq!(deleted["deleted"]["by"], format!("team:{}", team.id));
    assert_eq!(deleted["bundle_removed"]["reason"], "by its team");
    assert_eq!(deleted["log"], "ready\n");
    assert!(string(&deleted["blake3"]).len() == 64);
    assert!(string(&deleted["next"]).contains("upload it again"));
    assert_eq!(site.get(&submission, team_token).await.json(200), deleted);
    site.get(&bundle, team_token).await.problem(
        410,
        "removed",
        &["the bundle of the submission was removed on", "by its team"],
    );
    delete(&site, &submission, team_token, confirm)
        .await
        .problem(409, "conflict", &["was deleted on"]);
    site.post(&format!("{submission}/activate"), team_token, &json!({}))
        .await
        .problem(
            409,
            "conflict",
            &["was removed", "cannot be evaluated again"],
        );
    let view = site.get(&evaluation, team_token).await.json(200);
    assert_eq!(view["state"], "finished");
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["team"], "Alpha");
    let dataset = format!("{evaluation}/dataset");
    assert_eq!(site.get(&dataset, team_token).await.status, 200);
}

#[tokio::test]
async fn organiser_deletes_with_a_reason_but_not_evidence() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let team_token = Some(team.token.as_str());
    let first = site.valid_submission(&team, "a").await;
    let second = site.valid_submission(&team, "b").await;
    site.valid_submission(&team, "c").await;
    let request = json!({ "confirm": "striker.tar.gz", "reason": "it holds a virus" });
    let deleted = delete(&site, &first, Some(ADMIN), request.clone())
        .await
        .json(200);
    let reason = &deleted["bundle_removed"]["reason"];
    assert_eq!(reason, "by an organiser: it holds a virus");
    assert_eq!(deleted["deleted"]["by"], "organiser");

    // The bundles of a disqualified team are kept.
    let disqualify = format!("/api/v1/teams/{}/disqualify", team.id);
    let decision = json!({ "reason": "it spied", "confirm": "Alpha" });
    site.post(&disqualify, Some(ADMIN), &decision)
        .await
        .json(200);
    for token in [team_token, Some(ADMIN)] {
        delete(&site, &second, token, request.clone())
            .await
            .problem(409, "conflict", &["it spied", "kept as evidence"]);
    }
    // An organiser can still download a recently deleted bundle; its team cannot.
    let bundle = format!("{first}/bundle");
    site.get(&bundle, team_token)
        .await
        .problem(410, "removed", &[]);
    for path in [bundle, format!("{second}/bundle")] {
        assert_eq!(site.get(&path, Some(ADMIN)).await.status, 200);
    }
    let log = site
        .get("/api/v1/events?kind=submission_deleted", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(
        log["events"][0]["details"]["reason"],
        "by an organiser: it holds a virus"
    );
}

#[tokio::test]
async fn storage_is_shown_to_its_team_and_organisers() {
    let site = Site::start().await;
    let (team, other) = (site.team("Alpha").await, site.team("Beta").await);
    let submission = site.valid_submission(&team, "a").await;
    run_day(&site, &team, &submission, [0.5; 3]).await;
    let path = format!("/api/v1/teams/{}/storage", team.id);
    let view = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(view["team_name"], "Alpha");
    assert_eq!(view["bundles"], 1);
    assert_eq!(view["bundle_bytes"], GZIP.len());
    assert_eq!(view["datasets"], 1);
    assert_eq!(view["dataset_bytes"], DATASET.len());
    assert_eq!(view["unmeasured_datasets"], 0);
    assert_eq!(view["proposal_bytes"], Value::Null);
    assert!(view["quota_bytes"].as_u64().unwrap() > 0);
    site.get(&path, Some(&other.token))
        .await
        .problem(404, "not-found", &[]);
    site.get(&path, None)
        .await
        .problem(401, "unauthenticated", &[]);
    let usage = site.get("/api/v1/storage", Some(ADMIN)).await.json(200);
    assert_eq!(usage[0]["dataset_bytes"], DATASET.len());
    assert_eq!(usage[0]["proposal_bytes"], 0);
    assert_eq!(usage[1]["bundles"], 0);
    // The quota of the stage applies.
    site.change_first_stage(json!({ "uploads": { "stored_bytes": 5 } }))
        .await
        .json(200);
    let view = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(view["quota_bytes"], 5);
}
