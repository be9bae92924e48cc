//! Tests of evaluations in the API: progress, results, faults, cancelling and rerunning.

use crate::site::{ADMIN, DATASET, LEASE_S, Site, result, string};
use faceoff_testkit::{outcome, shard_commit, shard_outcomes};
use jiff::SignedDuration;
use serde_json::json;

#[tokio::test]
async fn evaluation_shows_progress_result_and_dataset() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    let token = Some(team.token.as_str());
    let queued = site.get(&path, token).await.json(200);
    assert_eq!(queued["state"], "queued");
    assert_eq!(queued["team_name"], "Alpha");
    assert_eq!(
        queued["progress"],
        json!({ "episodes_done": 0, "episodes_total": 12 })
    );
    site.get(&format!("{path}/dataset"), token)
        .await
        .problem(409, "conflict", &["not finished"]);

    let (claim, ..) = site.claim_shard().await;
    let episodes_done = 3;
    assert!(
        site.store
            .heartbeat(&claim, episodes_done, LEASE_S, site.now())
            .await
            .unwrap()
    );
    let running = site.get(&path, token).await.json(200);
    assert_eq!(running["state"], "running");
    assert_eq!(
        running["progress"],
        json!({ "episodes_done": 0, "episodes_total": 12 }),
        "no shard is complete"
    );
    let running = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(
        running["progress"],
        json!({ "episodes_done": 3, "episodes_total": 12 }),
        "organisers see all episodes"
    );
    site.store.release(&claim, site.now()).await.unwrap();

    let score = result([0.5, 0.6, 0.7], 100.0);
    site.finish_evaluation(&score).await;
    let finished = site.get(&path, token).await.json(200);
    assert_eq!(finished["state"], "finished");
    assert_eq!(
        finished["progress"],
        json!({ "episodes_done": 12, "episodes_total": 12 })
    );
    let published = serde_json::to_value(&score).unwrap();
    assert_eq!(
        finished["result"], published,
        "the day's last evaluation releases the day"
    );
    assert_eq!(finished["released_at"], "2026-03-01T10:00:00Z");
    assert_eq!(finished["dataset"], format!("{path}/dataset"));
    let hash = blake3::hash(DATASET.as_bytes()).to_string();
    assert_eq!(finished["dataset_blake3"], hash);
    let id = finished["id"].as_str().unwrap();
    let page = site.get(&format!("/evaluations/{id}"), None).await;
    assert!(page.body.contains(&hash), "{}", page.body);
    let me = site.get("/api/v1/me", token).await.json(200);
    assert_eq!(me["today"]["evaluation"], finished["id"]);

    let dataset = site.get(&format!("{path}/dataset"), token).await;
    assert_eq!(dataset.status, 200);
    assert_eq!(dataset.body, DATASET);
    assert_eq!(dataset.header("content-type"), "application/zip");
    assert_eq!(dataset.header("content-length"), DATASET.len().to_string());
    assert_eq!(
        dataset.header("content-disposition"),
        "attachment; filename=\"faceoff-Alpha-2026-03-01.zip\""
    );
}

#[tokio::test]
async fn single_evaluation_cannot_be_started() {
    let site = Site::start().await;
    let (team, other) = (site.team("Alpha").await, site.team("Beta").await);
    let submission = site.valid_submission(&team, "striker").await;
    let start = format!("{submission}/evaluations");
    let missing = "/api/v1/submissions/none/evaluations".to_owned();
    for path in [&start, &missing] {
        for token in [&*team.token, &other.token, ADMIN, "fo_team_wrong"] {
            site.post(path, Some(token), &json!({})).await.problem(
                410,
                "gone",
                &["one cut", "/activate"],
            );
        }
    }
    assert_eq!(
        site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200),
        json!([])
    );
    site.start_evaluation(&team, &submission).await;
    site.next_day();
    site.start_evaluation(&team, &submission).await;
    let team_evaluations = site
        .get("/api/v1/evaluations", Some(&team.token))
        .await
        .json(200);
    assert_eq!(team_evaluations.as_array().unwrap().len(), 2);
    let first_day = site
        .get("/api/v1/evaluations?day=2026-03-01", Some(&team.token))
        .await
        .json(200);
    assert_eq!(first_day.as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn failed_evaluation_shows_its_faults_and_log() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    site.run_shards_with_faults(2).await;
    let failed = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(failed["state"], "agent_failed", "{failed:#}");
    let fault = &failed["faults"][0];
    assert_eq!(
        fault["message"],
        "the action holds a number that is not finite"
    );
    // The first shard may be of any task.
    let task = string(&fault["task"]);
    assert_eq!(fault["step"], 3);
    assert_eq!(fault["line"], "{\"type\":\"act\"}");
    assert!(string(&failed["log"]).contains(&format!("log of {task}")));
    assert!(failed.get("result").is_none());
    let list = site.get("/api/v1/evaluations", Some(&team.token)).await;
    let listed = &list.json(200)[0];
    assert_eq!(listed["state"], "agent_failed");
    assert!(listed.get("faults").is_none() && listed.get("log").is_none());
    site.get(&format!("{path}/dataset"), Some(&team.token))
        .await
        .problem(409, "conflict", &["no dataset", "log"]);
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(
        me["today"]["evaluation"], failed["id"],
        "an evaluation that the agent failed counts"
    );

    let page = site.get(&path.replace("/api/v1", ""), None).await;
    assert_eq!(page.status, 200);
    assert!(page.body.contains("stopped"));
    assert!(!page.body.contains("not finite") && !page.body.contains("log of hit"));
}

/// An agent could speak to its team by the pace of its episodes.
#[tokio::test]
async fn progress_shows_whole_shards_once_a_minute() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    let progress = async || {
        let view = site.get(&path, Some(&team.token)).await.json(200);
        view["progress"]["episodes_done"].as_u64().unwrap()
    };
    let begin = site.now();
    let (claim, run, shard) = site.claim_shard().await;
    site.set_time(begin + SignedDuration::from_secs(7));
    assert!(
        site.store
            .heartbeat(&claim, 3, LEASE_S, site.now())
            .await
            .unwrap()
    );
    let outcomes = shard_outcomes(&shard, |task, episode| outcome(task, episode, false));
    let commit = shard_commit(outcomes, Some(claim.recording_key(run.id)));
    site.store
        .commit_shard(&claim, commit, site.now())
        .await
        .unwrap();
    // The clock of the tests starts at a full minute.
    for (seconds, expected) in [(8, 0), (59, 0), (60, 4), (61, 4)] {
        site.set_time(begin + SignedDuration::from_secs(seconds));
        assert_eq!(progress().await, expected, "after {seconds} s");
    }
}

#[tokio::test]
async fn cancelled_evaluation_shows_reason_and_can_be_rerun() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    let cancel = format!("{path}/cancel");
    let reason = json!({ "reason": "power cut" });
    site.post(&cancel, Some(&team.token), &reason)
        .await
        .problem(403, "forbidden", &[]);
    site.post(&cancel, Some(ADMIN), &json!({ "reason": " " }))
        .await
        .problem(422, "invalid-content", &["reason", "1 to 500"]);
    site.post(&cancel, Some(ADMIN), &reason).await.json(200);
    let cancelled = site.get(&path, Some(&team.token)).await.json(200);
    assert_eq!(cancelled["state"], "cancelled");
    assert_eq!(cancelled["reason"], "power cut");
    site.post(&cancel, Some(ADMIN), &reason)
        .await
        .problem(409, "conflict", &["over already"]);
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(me["today"]["evaluation"], json!(null));

    let rerun = format!("{path}/rerun");
    site.post(&rerun, Some(&team.token), &json!({}))
        .await
        .problem(403, "forbidden", &[]);
    let again = site.post(&rerun, Some(ADMIN), &json!({})).await;
    let again_path = again.header("location").to_owned();
    let again = again.json(201);
    assert_eq!(again["rerun_of"], cancelled["id"]);
    assert_eq!(again["rerun_after_release"], true);
    for field in ["submission", "day", "episodes_per_task", "profile"] {
        assert_eq!(again[field], cancelled[field], "{field}");
    }
    for path in [&rerun, &format!("{again_path}/rerun")] {
        site.post(path, Some(ADMIN), &json!({}))
            .await
            .problem(409, "conflict", &[]);
    }
    let missing = "/api/v1/evaluations/01890000-0000-7000-8000-000000000000/rerun";
    site.post(missing, Some(ADMIN), &json!({}))
        .await
        .problem(404, "not-found", &[]);
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["rerun_after_release"], true, "{board}");
    let page = site.get("/", None).await.body;
    assert!(page.contains("evaluated again after the release"), "{page}");
    let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
    assert_eq!(me["today"]["evaluation"], again["id"]);
}

#[tokio::test]
async fn evaluation_of_another_team_is_not_found() {
    let site = Site::start().await;
    let (owner, other) = (site.team("Owner").await, site.team("Other").await);
    let submission = site.valid_submission(&owner, "striker").await;
    let path = site.start_evaluation(&owner, &submission).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let dataset = format!("{path}/dataset");
    for path in [&path, &dataset] {
        let refused = site.get(path, Some(&other.token)).await;
        refused.problem(404, "not-found", &["evaluation"]);
        assert!(!refused.body.contains("Owner"));
        site.get(path, None)
            .await
            .problem(401, "unauthenticated", &[]);
        site.get(path, Some("fo_team_wrong"))
            .await
            .problem(401, "unauthenticated", &[]);
        assert_eq!(site.get(path, Some(ADMIN)).await.status, 200);
    }
    let missing = "/api/v1/evaluations/01890000-0000-7000-8000-000000000000";
    site.get(missing, Some(&owner.token))
        .await
        .problem(404, "not-found", &[]);
    site.get("/api/v1/evaluations/17", Some(&owner.token))
        .await
        .problem(404, "not-found", &["17"]);
    assert_eq!(
        site.get("/api/v1/evaluations", Some(&other.token))
            .await
            .json(200),
        json!([])
    );
    site.get("/api/v1/evaluations?day=tomorrow", Some(ADMIN))
        .await
        .problem(400, "invalid-request", &["day"]);
}
