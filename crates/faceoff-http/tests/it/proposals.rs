//! Tests of trials, which never count, and of proposed re-evaluations, which count once an organiser applies them, in the API.

use crate::site::{ADMIN, Site, outcome, string};
use faceoff_types::Task;
use serde_json::{Value, json};

const REASON: &str = "the camera was dirty";

/// The outcomes of an agent that solves the first `count` of four episodes of each task.
fn solve_first(count: u32) -> impl Fn(Task, u32) -> faceoff_types::EpisodeOutcome {
    move |task, episode| faceoff_types::EpisodeOutcome {
        success: episode < count,
        ..outcome(task, episode, false)
    }
}

/// A released day on which Alpha solved three of four episodes and Beta two. Returns their evaluations.
async fn run_day(site: &Site) -> [String; 2] {
    let [alpha, beta] = [solve_first(3), solve_first(2)];
    let ids = site.run_day(4, [("Alpha", &alpha), ("Beta", &beta)]).await;
    ids.map(|id| id.to_string())
}

/// Posts as an organiser.
async fn post(site: &Site, path: &str, body: Value) -> crate::site::Answer {
    site.post(path, Some(ADMIN), &body).await
}

/// The names of the teams on the board, in its order.
async fn ranked_teams(site: &Site) -> Vec<String> {
    let board = site.get("/api/v1/board", None).await.json(200);
    let rows = board["rows"].as_array().unwrap().iter();
    rows.map(|row| string(&row["team"])).collect()
}

#[tokio::test]
async fn trial_is_visible_to_organisers_only() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/trial");
    let request = json!({ "reason": REASON });
    post(&site, &path, request.clone()).await.problem(
        409,
        "conflict",
        &["no team has a valid submission"],
    );
    let submission = site.valid_submission(&alpha, "a").await;
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(alpha.token.as_str()), 403, "forbidden"),
    ] {
        site.post(&path, token, &request)
            .await
            .problem(status, slug, &[]);
        site.get("/api/v1/proposals", token)
            .await
            .problem(status, slug, &[]);
    }
    for (wrong, words) in [
        (json!({}), "reason"),
        (json!({ "reason": "" }), "reason"),
        (
            json!({ "reason": REASON, "submission": "mine" }),
            "submission",
        ),
        (json!({ "reason": REASON, "day": "2026-03-01" }), "day"),
    ] {
        post(&site, &path, wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    let unknown_submission = json!({ "reason": REASON, "submission": uuid::Uuid::nil() });
    post(&site, &path, unknown_submission)
        .await
        .problem(404, "not-found", &["submission"]);
    let unknown_stage = format!("/api/v1/stages/{}/trial", uuid::Uuid::nil());
    post(&site, &unknown_stage, request.clone())
        .await
        .problem(404, "not-found", &["stage"]);

    let id = submission.rsplit('/').next().unwrap();
    let trial = post(&site, &path, json!({ "reason": REASON, "submission": id }))
        .await
        .json(201);
    assert_eq!(
        (&trial["kind"], &trial["state"], &trial["day"]),
        (&json!("trial"), &json!("playing"), &Value::Null)
    );
    assert_eq!(trial["evaluations"][0]["state"], "queued");
    let proposal = format!("/api/v1/proposals/{}", string(&trial["id"]));
    site.get(&proposal, Some(&alpha.token))
        .await
        .problem(403, "forbidden", &[]);
    let evaluation = site.run_evaluation(solve_first(4)).await;
    let finished = site.get(&proposal, Some(ADMIN)).await.json(200);
    assert_eq!(
        (&finished["state"], &finished["evaluations"][0]["state"]),
        (&json!("played"), &json!("finished"))
    );
    assert_eq!(finished["evaluations"][0]["result"]["score"], 100.0);
    assert_eq!(finished["outcome"]["new_board"]["rows"][0]["team"], "Alpha");
    assert_eq!(
        (
            &finished["outcome"]["old_board"],
            &finished["outcome"]["changes"]
        ),
        (&Value::Null, &json!([]))
    );

    // The trial is on no board and on no page, and its team does not see it.
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["today"]["evaluation"], Value::Null);
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
    assert!(ranked_teams(&site).await.is_empty());
    assert_eq!(
        site.get("/api/v1/season", None).await.json(200)["days"],
        json!([])
    );

    post(&site, &format!("{proposal}/apply"), json!({}))
        .await
        .problem(409, "conflict", &["cannot be applied"]);
    post(&site, &format!("{proposal}/drop"), json!({}))
        .await
        .problem(409, "not-confirmed", &["will never count", "Qualifying"]);
    let confirmed = json!({ "confirm": "Qualifying" });
    let dropped = post(&site, &format!("{proposal}/drop"), confirmed)
        .await
        .json(200);
    assert_eq!(dropped["state"], "dropped");
    post(&site, &format!("{proposal}/drop"), json!({}))
        .await
        .problem(409, "conflict", &["was dropped"]);
    let list = site.get("/api/v1/proposals", Some(ADMIN)).await.json(200);
    assert_eq!(
        (&list[0]["id"], &list[0]["evaluations"]),
        (&trial["id"], &Value::Null)
    );
}

#[tokio::test]
async fn re_evaluation_previews_and_applies_rank_changes() {
    let site = Site::start().await;
    let [alpha_evaluation, beta_evaluation] = run_day(&site).await;
    assert_eq!(ranked_teams(&site).await, ["Alpha", "Beta"]);
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let created = post(
        &site,
        &path,
        json!({ "day": "2026-03-01", "reason": REASON }),
    )
    .await
    .json(201);
    let proposal = format!("/api/v1/proposals/{}", string(&created["id"]));
    let apply = format!("{proposal}/apply");
    post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .problem(
            409,
            "conflict",
            &["2 of its evaluations are queued or running"],
        );
    // In the re-evaluation Alpha solves one episode, Beta two as before.
    site.run_evaluation(solve_first(1)).await;
    assert_eq!(
        site.get(&proposal, Some(ADMIN)).await.json(200)["outcome"],
        Value::Null
    );
    site.run_evaluation(solve_first(2)).await;
    assert_eq!(
        ranked_teams(&site).await,
        ["Alpha", "Beta"],
        "nothing has changed"
    );

    let view = site.get(&proposal, Some(ADMIN)).await.json(200);
    assert_eq!(
        (&view["kind"], &view["state"]),
        (&json!("day"), &json!("played"))
    );
    let replaced: Vec<_> = view["evaluations"]
        .as_array()
        .unwrap()
        .iter()
        .map(|evaluation| string(&evaluation["replaces"]))
        .collect();
    assert_eq!(
        replaced,
        [alpha_evaluation.clone(), beta_evaluation.clone()]
    );
    let outcome = &view["outcome"];
    let teams = |board: &Value| -> Vec<String> {
        let rows = board["rows"].as_array().unwrap().iter();
        rows.map(|row| string(&row["team"])).collect()
    };
    assert_eq!(teams(&outcome["old_board"]), ["Alpha", "Beta"]);
    assert_eq!(teams(&outcome["new_board"]), ["Beta", "Alpha"]);
    let rank_view = |rank: u32, score: f64| json!({ "rank": rank, "tier": "deployable", "score": score, "penalty_points": 0.0 });
    assert_eq!(
        outcome["changes"],
        json!([
            { "team": "Beta", "old": rank_view(2, 50.0), "new": rank_view(1, 50.0) },
            { "team": "Alpha", "old": rank_view(1, 75.0), "new": rank_view(2, 25.0) },
        ])
    );

    for unconfirmed in [json!({}), json!({ "confirm": "2026-03-02" })] {
        let problem = post(&site, &apply, unconfirmed).await.problem(
            409,
            "not-confirmed",
            &["2 evaluations of 2026-03-01", "2 another rank", REASON],
        );
        assert_eq!(problem["confirm"], "2026-03-01");
    }
    assert_eq!(ranked_teams(&site).await, ["Alpha", "Beta"]);
    let applied = post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .json(200);
    assert_eq!(
        (&applied["state"], &applied["outcome"]),
        (&json!("applied"), &Value::Null)
    );
    assert_eq!(ranked_teams(&site).await, ["Beta", "Alpha"]);
    let replaced_view = site
        .get(
            &format!("/api/v1/evaluations/{alpha_evaluation}"),
            Some(ADMIN),
        )
        .await
        .json(200);
    assert_eq!(
        replaced_view["voided"]["reason"],
        format!("evaluated again: {REASON}")
    );
    let board = site.get("/api/v1/board", None).await.json(200);
    let new_evaluation = string(&board["rows"][1]["evaluation"]);
    assert_eq!(json!(new_evaluation), view["evaluations"][0]["evaluation"]);
    let view = site
        .get(
            &format!("/api/v1/evaluations/{new_evaluation}"),
            Some(ADMIN),
        )
        .await
        .json(200);
    assert_eq!(
        (&view["rerun_of"], &view["state"]),
        (&json!(alpha_evaluation), &json!("finished"))
    );
    post(&site, &apply, json!({ "confirm": "2026-03-01" }))
        .await
        .problem(409, "conflict", &["was applied"]);
}

#[tokio::test]
async fn invalid_re_evaluation_is_refused_with_the_reason() {
    let site = Site::start().await;
    let [alpha_evaluation, _] = run_day(&site).await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let team = site.team("Gamma").await;
    let request = json!({ "day": "2026-03-01", "reason": REASON });
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(team.token.as_str()), 403, "forbidden"),
    ] {
        site.post(&path, token, &request)
            .await
            .problem(status, slug, &[]);
        for action in ["apply", "drop"] {
            let path = format!("/api/v1/proposals/{}/{action}", uuid::Uuid::nil());
            site.post(&path, token, &json!({}))
                .await
                .problem(status, slug, &[]);
        }
    }
    for (wrong, words) in [
        (json!({ "day": "2026-03-01" }), "reason"),
        (json!({ "reason": REASON }), "exactly one of"),
        (
            json!({ "day": "2026-03-01", "evaluation": alpha_evaluation, "reason": REASON }),
            "exactly one of",
        ),
        (
            json!({ "evaluation": alpha_evaluation, "new_rules": true, "reason": REASON }),
            "name the “day”",
        ),
        (json!({ "day": "yesterday", "reason": REASON }), "day"),
        (json!({ "day": "2026-03-01", "reason": "" }), "reason"),
        (
            json!({ "day": "2026-03-01", "reason": REASON, "new_rules": "yes" }),
            "new_rules",
        ),
    ] {
        post(&site, &path, wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    post(
        &site,
        &path,
        json!({ "day": "2026-03-02", "reason": REASON }),
    )
    .await
    .problem(404, "not-found", &["day"]);
    post(
        &site,
        &path,
        json!({ "evaluation": uuid::Uuid::nil(), "reason": REASON }),
    )
    .await
    .problem(404, "not-found", &["evaluation"]);
    let other_stage_view = post(&site, "/api/v1/stages", json!({ "name": "Final" }))
        .await
        .json(201);
    let other_stage = format!(
        "/api/v1/stages/{}/proposals",
        string(&other_stage_view["id"])
    );
    post(
        &site,
        &other_stage,
        json!({ "evaluation": alpha_evaluation, "reason": REASON }),
    )
    .await
    .problem(404, "not-found", &["in this stage"]);
    post(
        &site,
        &path,
        json!({ "day": "2026-03-01", "new_rules": true, "reason": REASON }),
    )
    .await
    .problem(409, "conflict", &["newest rules"]);
    site.next_day();
    post(&site, "/api/v1/days", json!({ "stage": stage }))
        .await
        .json(200);
    post(
        &site,
        &path,
        json!({ "day": "2026-03-02", "reason": REASON }),
    )
    .await
    .problem(409, "conflict", &["not released"]);
    for action in ["", "/apply", "/drop"] {
        let path = format!("/api/v1/proposals/{}{action}", uuid::Uuid::nil());
        let answer = match action {
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
async fn re_evaluation_by_new_rules_has_its_own_board() {
    let site = Site::start().await;
    run_day(&site).await;
    let stage = site.stage().await;
    let rules = json!({ "max_faults": 3, "confirm": "Qualifying" });
    site.change_stage(stage, rules).await.json(200);
    let path = format!("/api/v1/stages/{stage}/proposals");
    let request = json!({ "day": "2026-03-01", "new_rules": true, "reason": REASON });
    let created = post(&site, &path, request).await.json(201);
    site.run_evaluation(solve_first(1)).await;
    site.run_evaluation(solve_first(4)).await;
    let proposal = format!("/api/v1/proposals/{}", string(&created["id"]));
    let view = site.get(&proposal, Some(ADMIN)).await.json(200);
    let outcome = &view["outcome"];
    let newest = view["revision"].as_u64().unwrap();
    assert_eq!(outcome["old_board"]["revision"], json!(newest - 1));
    assert_eq!(outcome["new_board"]["revision"], json!(newest));
    assert_eq!(outcome["changes"].as_array().unwrap().len(), 2);
    post(
        &site,
        &format!("{proposal}/apply"),
        json!({ "confirm": "2026-03-01" }),
    )
    .await
    .json(200);
    assert_eq!(ranked_teams(&site).await, ["Beta", "Alpha"]);
    let old_board = format!("/api/v1/board?stage={stage}&revision={}", newest - 1);
    let old_board = site.get(&old_board, None).await.json(200);
    assert_eq!(
        old_board["rows"][0]["team"], "Alpha",
        "the board of the old rules stays"
    );
}

#[tokio::test]
async fn proposal_datasets_are_for_organisers_until_dropped() {
    let site = Site::start().await;
    run_day(&site).await;
    let stage = site.stage().await;
    let gamma = site.team("Gamma").await;
    let path = format!("/api/v1/stages/{stage}/proposals");
    let request = json!({ "day": "2026-03-01", "reason": REASON });
    let created = post(&site, &path, request).await.json(201);
    let proposal = format!("/api/v1/proposals/{}", string(&created["id"]));
    let dataset_of = |proposal: &Value, index: usize| {
        let id = string(&proposal["evaluations"][index]["evaluation"]);
        format!("/api/v1/evaluations/{id}/dataset")
    };
    let [first, second] = [dataset_of(&created, 0), dataset_of(&created, 1)];
    site.get(&first, Some(ADMIN))
        .await
        .problem(409, "conflict", &["has not finished", &proposal]);
    site.run_evaluation(solve_first(1)).await;
    site.run_shards_with_faults(4).await;

    let view = site.get(&proposal, Some(ADMIN)).await.json(200);
    let finished = &view["evaluations"][0];
    assert_eq!(string(&finished["dataset"]), first);
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
    assert_eq!(string(&finished["dataset_blake3"]), hash);
    site.get(&second, Some(ADMIN))
        .await
        .problem(409, "conflict", &["too many faults"]);
    // No team may download it, not even the team of the submission.
    let alpha = string(&view["evaluations"][0]["team"]);
    let token = format!("/api/v1/teams/{alpha}/token");
    let token = post(&site, &token, json!({})).await.json(200);
    for (token, status, slug) in [
        (None, 401, "unauthenticated"),
        (Some(gamma.token.as_str()), 404, "not-found"),
        (token["token"].as_str(), 404, "not-found"),
    ] {
        site.get(&first, token).await.problem(status, slug, &[]);
    }

    // Once applied, the dataset keeps its path, and its team may download it.
    post(
        &site,
        &format!("{proposal}/apply"),
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

    // Once dropped, the dataset is gone.
    let trial = format!("/api/v1/stages/{stage}/trial");
    let request = json!({ "reason": REASON, "submission": view["evaluations"][0]["submission"] });
    let trial = post(&site, &trial, request).await.json(201);
    site.run_evaluation(solve_first(2)).await;
    let trial_dataset = dataset_of(&trial, 0);
    assert_eq!(site.get(&trial_dataset, Some(ADMIN)).await.status, 200);
    let proposal = format!("/api/v1/proposals/{}", string(&trial["id"]));
    let confirmed = json!({ "confirm": "Qualifying" });
    let dropped = post(&site, &format!("{proposal}/drop"), confirmed)
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
    for _ in ["before the file is removed", "after the file is removed"] {
        site.get(&trial_dataset, Some(ADMIN)).await.problem(
            410,
            "gone",
            &["was dropped at", &proposal],
        );
        site.store
            .remove_dropped_datasets(site.now())
            .await
            .unwrap();
    }
    site.get(&trial_dataset, Some(&gamma.token))
        .await
        .problem(404, "not-found", &[]);
}
