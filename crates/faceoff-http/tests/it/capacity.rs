//! Tests of the capacity forecast (will a day's evaluations finish before its deadline?), of queue positions and next steps,
//! and of warnings about days that do not fit.

use crate::site::{ADMIN, Site, invalid_outcome, outcome, string};
use faceoff_store::*;
use faceoff_testkit::{shard_commit, shard_outcomes};
use serde_json::{Value, json};

/// Runs the next evaluation. Each job takes `job_s` seconds.
pub async fn run_evaluation_slowly(site: &Site, job_s: i64) {
    loop {
        let ClaimedJob { claim, job } = site.claim().await;
        site.advance(job_s);
        match job {
            Job::Shard { run, shard, .. } => {
                let outcomes =
                    shard_outcomes(&shard, |task, episode| outcome(task, episode, false));
                let commit = shard_commit(outcomes, Some(claim.recording_key(run.id)));
                let committed = site.store.commit_shard(&claim, commit, site.now());
                assert_eq!(committed.await.unwrap(), CommitOutcome::Stored);
            }
            Job::Scoring { .. } => {
                let penalty_points = 10.0;
                let result = crate::site::result([0.5, 0.5, 0.5], penalty_points);
                let key = "datasets/never-read.zip";
                let hash = blake3::hash(b"never read").to_string();
                let finished =
                    site.store
                        .finish_evaluation(&claim, &result, key, &hash, site.now());
                finished.await.unwrap();
                return;
            }
            Job::Validation { .. } | Job::Game { .. } => {
                panic!("expected a shard or a scoring job")
            }
        }
    }
}

#[tokio::test]
async fn forecast_reports_a_day_that_will_not_fit() {
    let site = Site::start_with_schedule("12:00").await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let path = format!("/api/v1/stages/{stage}/capacity");
    let capacity = async || site.get(&path, Some(ADMIN)).await.json(200);

    let empty = capacity().await;
    assert_eq!(
        (&empty["stage_name"], &empty["slots"]),
        (&json!("Qualifying"), &json!(2))
    );
    assert_eq!(empty["days"][0]["teams"], 0);
    assert!(string(&empty["days"][0]["summary"]).contains("no team has a valid submission"));

    let submission = site.valid_submission(&alpha, "a").await;
    let unmeasured = capacity().await["days"][0].clone();
    // 3 tasks × 4 episodes, one shard each. The time is one day: from the next cutoff to the following one.
    assert_eq!(
        (
            &unmeasured["day"],
            &unmeasured["is_under_way"],
            &unmeasured["teams"],
            &unmeasured["episodes"]
        ),
        (&json!("2026-03-01"), &json!(false), &json!(1), &json!(12))
    );
    assert_eq!(unmeasured["deadline_at"], "2026-03-02T12:00:00Z");
    assert_eq!(unmeasured["hours_until_deadline"], 24.0);
    assert_eq!(unmeasured["expected_hours"], Value::Null);
    // Limits in seconds: 125 for the start and exit of an agent, 40 for the resets of a shard, and 23.2 for an episode. Three
    // shards, one restart after a fault, and 12 episodes, on two slots.
    let worst_case = unmeasured["worst_case_hours"].as_f64().unwrap();
    let expected = (3.0 * (125.0 + 40.0) + 125.0 + 12.0 * 23.2) / (2.0 * 3600.0);
    assert!((worst_case - expected).abs() < 1e-9, "{worst_case}");
    assert_eq!(unmeasured["fit"], "surely");
    site.change_stage(&stage, json!({ "day_deadline": { "hours": 1 }, "episodes_per_task": 1000, "confirm": "Qualifying" }))
        .await
        .json(200);
    assert_eq!(capacity().await["days"][0]["fit"], "unknown");
    site.change_stage(
        &stage,
        json!({ "episodes_per_task": 4, "confirm": "Qualifying" }),
    )
    .await
    .json(200);

    site.start_evaluation(&alpha, &submission).await;
    run_evaluation_slowly(&site, 300).await;
    site.next_day();
    site.change_stage(
        &stage,
        json!({ "episodes_per_task": 1000, "confirm": "Qualifying" }),
    )
    .await
    .json(200);
    let too_much = capacity().await["days"][0].clone();
    // 75 s for an episode, 3000 of them on two slots
    assert_eq!(too_much["expected_hours"], 31.25);
    assert_eq!(
        (&too_much["fit"], &too_much["hours_until_deadline"]),
        (&json!("not"), &json!(1.0))
    );
    let summary = string(&too_much["summary"]);
    for words in [
        "31.2 hours",
        "1.0 hours",
        "does not fit",
        "will not count",
        "More slots",
    ] {
        assert!(summary.contains(words), "{words} is not in {summary}");
    }

    // Once the day has started, the remaining episodes are compared with the remaining time.
    let evaluation = site.start_evaluation(&alpha, &submission).await;
    site.advance(1800);
    let days = capacity().await["days"].clone();
    assert_eq!(days.as_array().unwrap().len(), 2);
    assert_eq!(
        (
            &days[0]["is_under_way"],
            &days[0]["hours_until_deadline"],
            &days[0]["fit"]
        ),
        (&json!(true), &json!(0.5), &json!("not"))
    );
    let view = site.get(&evaluation, Some(&alpha.token)).await.json(200);
    assert_eq!(view["deadline_at"], days[0]["deadline_at"]);
    site.advance(1800);
    site.store.end_overdue_days(site.now()).await.unwrap();
    let view = site.get(&evaluation, Some(&alpha.token)).await.json(200);
    assert_eq!(view["state"], "not_played");
    assert!(
        string(&view["reason"]).contains("the server ran out of time"),
        "{view}"
    );
    assert!(
        string(&view["next"]).contains("earlier day stays"),
        "{view}"
    );
    assert_eq!(view["queue"], Value::Null);
    let board = site.get("/api/v1/board?revision=3", None).await.json(200);
    assert_eq!(board["rows"][0]["day"], "2026-03-01", "{board}");
    let page = evaluation.replace("/api/v1", "");
    let page = site.get(&page, None).await;
    assert!(
        page.body.contains("the server ran out of time"),
        "{}",
        page.body
    );
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["today"]["evaluation"], Value::Null);
}

#[tokio::test]
async fn pending_jobs_show_position_time_and_next_step() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let mut submissions = Vec::new();
    for team in [&alpha, &beta] {
        submissions.push(site.valid_submission(team, "a").await);
    }
    let uploaded = site.upload(&alpha.token, crate::site::GZIP.to_vec()).await;
    let new_submission = format!("/api/v1/submissions/{}", string(&uploaded.json(201)["id"]));
    let waiting = site
        .get(&new_submission, Some(&alpha.token))
        .await
        .json(200);
    // `place` and `of` are the former names of `position` and `total`.
    assert_eq!(
        waiting["queue"],
        json!({ "position": 1, "place": 1, "total": 1, "of": 1, "expected_at": null })
    );
    assert!(string(&waiting["next"]).contains("validation run"));
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["validating"][0]["queue"], waiting["queue"]);
    let list = site
        .get("/api/v1/submissions", Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(list[0]["queue"], waiting["queue"]);
    assert_eq!(list[1]["queue"], Value::Null);
    assert!(string(&list[1]["next"]).contains("evaluated at the next cutoff"));
    let validation = site.claim().await;
    site.advance(20);
    let outcome = invalid_outcome("no agent.toml", "");
    site.store
        .commit_validation(&validation.claim, outcome, site.now())
        .await
        .unwrap();
    let invalid = site
        .get(&new_submission, Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(invalid["queue"], Value::Null);
    assert!(string(&invalid["next"]).contains("upload again"));
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["validating"], json!([]));

    let alpha_evaluation = site.start_evaluation(&alpha, &submissions[0]).await;
    let beta_evaluation = site.start_evaluation(&beta, &submissions[1]).await;
    run_evaluation_slowly(&site, 60).await;
    let mut pending = Vec::new();
    for (team, path) in [(&alpha, &alpha_evaluation), (&beta, &beta_evaluation)] {
        let view = site.get(path, Some(&team.token)).await.json(200);
        let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
        assert_eq!(me["today"]["queue"], view["queue"]);
        assert_eq!(me["today"]["next"], view["next"]);
        if view["state"] != "finished" {
            pending.push((view, path.replace("/api/v1", "")));
        }
    }
    let (view, page) = &pending[0];
    assert_eq!(pending.len(), 1);
    assert_eq!(
        (&view["queue"]["position"], &view["queue"]["total"]),
        (&json!(1), &json!(1))
    );
    let expected: jiff::Timestamp = string(&view["queue"]["expected_at"]).parse().unwrap();
    assert!(expected > site.now());
    let day_evaluations = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
    let listed = day_evaluations
        .as_array()
        .unwrap()
        .iter()
        .find(|evaluation| evaluation["id"] == view["id"]);
    assert_eq!(listed.unwrap()["queue"], view["queue"]);
    let page = site.get(page, None).await.body;
    assert!(
        page.contains("Position 1 of 1 in the queue; expected end <time datetime=\"2026-03-01"),
        "{page}"
    );
    assert!(page.contains("What happens next"), "{page}");
}

#[tokio::test]
async fn capacity_is_for_organisers_and_deadlines_are_validated() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let path = format!("/api/v1/stages/{stage}/capacity");
    site.get(&path, None)
        .await
        .problem(401, "unauthenticated", &[]);
    site.get(&path, Some(&alpha.token))
        .await
        .problem(403, "forbidden", &[]);
    for wrong in ["first", "00000000-0000-0000-0000-000000000000"] {
        let path = format!("/api/v1/stages/{wrong}/capacity");
        site.get(&path, Some(ADMIN))
            .await
            .problem(404, "not-found", &[]);
    }
    for (wrong, words) in [
        (json!("tomorrow"), "next_cut"),
        (json!({ "hours": 0 }), "1 to 744"),
        (json!({ "hours": 745 }), "1 to 744"),
        (json!({ "hours": -1 }), "day_deadline"),
        (json!({ "days": 1 }), "hours"),
        (json!(30), "day_deadline"),
    ] {
        let body = json!({ "day_deadline": wrong });
        site.change_stage(&stage, body.clone())
            .await
            .problem(422, "invalid-content", &[words]);
        let body = json!({ "name": "Final", "day_deadline": wrong });
        site.post("/api/v1/stages", Some(ADMIN), &body)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    let body = json!({ "name": "Final", "day_deadline": "never" });
    let created = site
        .post("/api/v1/stages", Some(ADMIN), &body)
        .await
        .json(201);
    assert_eq!(created["day_deadline"], "never");
    let unchanged = site
        .get(&format!("/api/v1/stages/{stage}"), None)
        .await
        .json(200);
    assert_eq!(unchanged["day_deadline"], "next_cut");
}

#[tokio::test]
async fn monitor_warns_once_of_each_day_that_does_not_fit() {
    let site = Site::start_with_schedule("12:00").await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let submission = site.valid_submission(&alpha, "a").await;
    let mut monitor = site.capacity_monitor();
    let set_episodes = async |episodes: u32| {
        let rules = json!({ "episodes_per_task": episodes, "confirm": "Qualifying" });
        site.change_stage(&stage, rules).await.json(200)
    };
    let set_deadline = async |hours: u32| {
        let deadline = json!({ "day_deadline": { "hours": hours } });
        site.change_stage(&stage, deadline).await.json(200);
    };
    set_deadline(1).await;
    let changed = set_episodes(1000).await;
    // Without a measured duration the summary says so, and there is no warning.
    let load = &changed["capacity"][0];
    assert_eq!(
        (&load["fit"], &load["expected_hours"]),
        (&json!("unknown"), &Value::Null)
    );
    assert!(string(&load["summary"]).contains("nothing measured"));
    assert_eq!(monitor.check().await.unwrap(), []);
    let page = async |token: Option<&str>| site.get("/season", token).await.body;
    let season_page = page(Some(ADMIN)).await;
    assert!(
        season_page.contains("nothing measured") && !season_page.contains("does not fit"),
        "{season_page}"
    );

    set_episodes(4).await;
    site.start_evaluation(&alpha, &submission).await;
    run_evaluation_slowly(&site, 300).await;
    site.next_day();
    assert_eq!(monitor.check().await.unwrap(), [], "12 episodes fit");
    set_episodes(1000).await;
    let warnings = monitor.check().await.unwrap();
    let days = |warnings: &[faceoff_http::CapacityWarning]| -> Vec<(String, bool)> {
        let days = warnings.iter().map(|warning| &warning.load);
        days.map(|load| (load.day.to_string(), load.is_under_way))
            .collect()
    };
    assert_eq!(days(&warnings), [("2026-03-02".to_owned(), false)]);
    assert_eq!(warnings[0].stage.as_str(), "Qualifying");
    assert!(warnings[0].load.summary.contains("does not fit"));
    assert_eq!(monitor.check().await.unwrap(), [], "a day is reported once");

    // The forecast is on the page and in the views of stages, for organisers only.
    for path in [
        "/api/v1/stages".to_owned(),
        format!("/api/v1/stages/{stage}"),
        "/api/v1/season".to_owned(),
    ] {
        let stage_view = |answer: Value| match path.as_str() {
            "/api/v1/stages" => answer[0].clone(),
            "/api/v1/season" => answer["stages"][0].clone(),
            _ => answer,
        };
        let view = stage_view(site.get(&path, Some(ADMIN)).await.json(200));
        assert_eq!(view["capacity"][0]["fit"], "not", "{path}");
        for token in [None, Some(alpha.token.as_str())] {
            let view = stage_view(site.get(&path, token).await.json(200));
            assert_eq!(view.get("capacity"), None, "{path}");
        }
    }
    let season_page = page(Some(ADMIN)).await;
    assert!(
        season_page.contains("does not fit") && season_page.contains(&warnings[0].load.summary),
        "{season_page}"
    );
    assert!(!page(None).await.contains("id=\"capacity\""));

    // After the cutoff the day is reported again, and the following day for the first time.
    site.start_evaluation(&alpha, &submission).await;
    let warnings = monitor.check().await.unwrap();
    let expected = [
        ("2026-03-02".to_owned(), true),
        ("2026-03-03".to_owned(), false),
    ];
    assert_eq!(days(&warnings), expected);
    set_deadline(100).await;
    assert_eq!(monitor.check().await.unwrap(), []);
    set_deadline(1).await;
    assert_eq!(
        days(&monitor.check().await.unwrap()),
        expected,
        "reported again after it fitted in between"
    );
    assert_eq!(monitor.check().await.unwrap(), []);
}
