//! Whether a day fits, where what waits stands, and what happens to it next.

use crate::site::{ADMIN, Answer, Site, text};
use faceoff_store::*;
use reqwest::Method;
use serde_json::{Value, json};

pub async fn change(site: &Site, stage: &str, body: Value) -> Answer {
    let path = format!("/api/v1/stages/{stage}");
    let request = site.request(Method::PATCH, &path, Some(ADMIN)).json(&body);
    Answer::of(request.send().await.unwrap()).await
}

/// Plays the next evaluation; each shard takes so many seconds.
pub async fn play_slowly(site: &Site, seconds: i64) {
    loop {
        let Claimed { claim, work } = site.claim().await;
        site.later(seconds);
        match work {
            Work::Shard { run, shard, .. } => {
                let commit = ShardCommit {
                    outcomes: (shard.first_episode..shard.end_episode)
                        .map(|episode| crate::site::outcome(shard.task, episode, false))
                        .collect(),
                    log: String::new(),
                    stopped_by_faults: false,
                    recording: Some(claim.recording_key(run.id)),
                };
                let committed = site.store.commit_shard(&claim, commit, site.now());
                assert_eq!(committed.await.unwrap(), Committed::Now);
            }
            Work::Finalise { .. } => {
                let result = crate::site::result([0.5, 0.5, 0.5], 10.0);
                let hash = blake3::hash(b"d").to_string();
                let finished =
                    site.store
                        .finish_evaluation(&claim, &result, "d", &hash, site.now());
                finished.await.unwrap();
                return;
            }
            Work::Smoke { .. } | Work::Game { .. } => panic!("no upload waits, and no game"),
        }
    }
}

#[tokio::test]
async fn a_day_that_will_not_fit_is_told_of_before_it_starts() {
    let site = Site::start_daily("12:00").await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let path = format!("/api/v1/stages/{stage}/capacity");
    let capacity = async || site.get(&path, Some(ADMIN)).await.json(200);

    let none = capacity().await;
    assert_eq!(
        (&none["stage_name"], &none["slots"]),
        (&json!("Qualifying"), &json!(2))
    );
    assert_eq!(none["days"][0]["teams"], 0);
    assert!(text(&none["days"][0]["summary"]).contains("no team has a valid submission"));

    let submission = site.valid_submission(&alpha, "a").await;
    let unknown = capacity().await["days"][0].clone();
    // 3 tasks × 4 episodes, a shard each; the next cut, and a day until the one after.
    assert_eq!(
        (
            &unknown["day"],
            &unknown["is_under_way"],
            &unknown["teams"],
            &unknown["episodes"]
        ),
        (&json!("2026-03-01"), &json!(false), &json!(1), &json!(12))
    );
    assert_eq!(unknown["deadline_at"], "2026-03-02T12:00:00Z");
    assert_eq!(unknown["hours_until_deadline"], 24.0);
    assert_eq!(unknown["expected_hours"], Value::Null);
    // 3 shards × (125 + 40) + 1 fault × 125 + 12 × 23.2 s on two slots
    let worst = unknown["worst_case_hours"].as_f64().unwrap();
    assert!(
        (worst - (3.0 * 165.0 + 125.0 + 12.0 * 23.2) / 7200.0).abs() < 1e-9,
        "{worst}"
    );
    assert_eq!(unknown["fit"], "surely");
    change(&site, &stage, json!({ "day_deadline": { "hours": 1 }, "episodes_per_task": 1000, "confirm": "Qualifying" }))
        .await
        .json(200);
    assert_eq!(capacity().await["days"][0]["fit"], "unknown");
    change(
        &site,
        &stage,
        json!({ "episodes_per_task": 4, "confirm": "Qualifying" }),
    )
    .await
    .json(200);

    site.evaluate(&alpha, &submission).await;
    play_slowly(&site, 300).await;
    site.next_day();
    change(
        &site,
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
    let summary = text(&too_much["summary"]);
    for words in [
        "31.2 hours",
        "1.0 hours",
        "does not fit",
        "not played",
        "more slots",
    ] {
        assert!(summary.contains(words), "{words} is not in {summary}");
    }

    // Under way, it is what is left of it against what is left of the time.
    let evaluation = site.evaluate(&alpha, &submission).await;
    site.later(1800);
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
    site.later(1800);
    site.store.end_overdue_days(site.now()).await.unwrap();
    let view = site.get(&evaluation, Some(&alpha.token)).await.json(200);
    assert_eq!(view["state"], "not_played");
    assert!(text(&view["reason"]).contains("our capacity"), "{view}");
    assert!(text(&view["next"]).contains("older day stays"), "{view}");
    assert_eq!(view["queue"], Value::Null);
    let board = site.get("/api/v1/board?revision=3", None).await.json(200);
    assert_eq!(board["rows"][0]["day"], "2026-03-01", "{board}");
    let page = evaluation.replace("/api/v1", "");
    let page = site.get(&page, None).await;
    assert!(
        page.body.contains("for want of this server"),
        "{}",
        page.body
    );
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["turn"]["evaluation"], Value::Null);
}

#[tokio::test]
async fn what_waits_tells_its_place_its_time_and_what_comes_next() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let mut agents = Vec::new();
    for team in [&alpha, &beta] {
        agents.push(site.valid_submission(team, "a").await);
    }
    let upload = site.upload(&alpha.token, crate::site::GZIP.to_vec()).await;
    let upload = format!("/api/v1/submissions/{}", text(&upload.json(201)["id"]));
    let waiting = site.get(&upload, Some(&alpha.token)).await.json(200);
    assert_eq!(
        waiting["queue"],
        json!({ "place": 1, "of": 1, "expected_at": null })
    );
    assert!(text(&waiting["next"]).contains("smoke run"));
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["validating"][0]["queue"], waiting["queue"]);
    let list = site
        .get("/api/v1/submissions", Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(list[0]["queue"], waiting["queue"]);
    assert_eq!(list[1]["queue"], Value::Null);
    assert!(text(&list[1]["next"]).contains("plays at the next cut"));
    let smoke = site.claim().await;
    site.later(20);
    let outcome = faceoff_types::SmokeOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "no agent.toml".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    site.store
        .commit_smoke(&smoke.claim, outcome, site.now())
        .await
        .unwrap();
    let refused = site.get(&upload, Some(&alpha.token)).await.json(200);
    assert_eq!(refused["queue"], Value::Null);
    assert!(text(&refused["next"]).contains("upload another"));
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["validating"], json!([]));

    let of_alpha = site.evaluate(&alpha, &agents[0]).await;
    let of_beta = site.evaluate(&beta, &agents[1]).await;
    play_slowly(&site, 60).await;
    let mut left = Vec::new();
    for (team, path) in [(&alpha, &of_alpha), (&beta, &of_beta)] {
        let view = site.get(path, Some(&team.token)).await.json(200);
        let me = site.get("/api/v1/me", Some(&team.token)).await.json(200);
        assert_eq!(me["turn"]["queue"], view["queue"]);
        assert_eq!(me["turn"]["next"], view["next"]);
        if view["state"] != "finished" {
            left.push((view, path.replace("/api/v1", "")));
        }
    }
    let (view, page) = &left[0];
    assert_eq!(left.len(), 1);
    assert_eq!(
        (&view["queue"]["place"], &view["queue"]["of"]),
        (&json!(1), &json!(1))
    );
    let expected: jiff::Timestamp = text(&view["queue"]["expected_at"]).parse().unwrap();
    assert!(expected > site.now());
    let of_day = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
    let listed = of_day
        .as_array()
        .unwrap()
        .iter()
        .find(|one| one["id"] == view["id"]);
    assert_eq!(listed.unwrap()["queue"], view["queue"]);
    let page = site.get(page, None).await.body;
    assert!(
        page.contains("Number 1 of 1 to be over; expected to be over <time datetime=\"2026-03-01"),
        "{page}"
    );
    assert!(page.contains("What happens next"), "{page}");
}

#[tokio::test]
async fn capacity_is_the_organisers_and_deadlines_are_checked() {
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
        change(&site, &stage, body.clone())
            .await
            .problem(422, "invalid-content", &[words]);
        let body = json!({ "name": "Final", "day_deadline": wrong });
        site.post("/api/v1/stages", Some(ADMIN), &body)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    let body = json!({ "name": "Final", "day_deadline": "never" });
    let made = site
        .post("/api/v1/stages", Some(ADMIN), &body)
        .await
        .json(201);
    assert_eq!(made["day_deadline"], "never");
    let is = site
        .get(&format!("/api/v1/stages/{stage}"), None)
        .await
        .json(200);
    assert_eq!(is["day_deadline"], "next_cut");
}

#[tokio::test]
async fn organisers_are_warned_once_of_each_day_that_does_not_fit() {
    let site = Site::start_daily("12:00").await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let submission = site.valid_submission(&alpha, "a").await;
    let mut watch = site.capacity_watch();
    let plays = async |episodes: u32| {
        let rules = json!({ "episodes_per_task": episodes, "confirm": "Qualifying" });
        change(&site, &stage, rules).await.json(200)
    };
    let lasts = async |hours: u32| {
        let deadline = json!({ "day_deadline": { "hours": hours } });
        change(&site, &stage, deadline).await.json(200);
    };
    lasts(1).await;
    let changed = plays(1000).await;
    // Nothing was measured: it says so, and nobody is warned.
    let load = &changed["capacity"][0];
    assert_eq!(
        (&load["fit"], &load["expected_hours"]),
        (&json!("unknown"), &Value::Null)
    );
    assert!(text(&load["summary"]).contains("nothing was measured"));
    assert_eq!(watch.look().await.unwrap(), []);
    let page = async |token: Option<&str>| site.get("/season", token).await.body;
    let shown = page(Some(ADMIN)).await;
    assert!(
        shown.contains("nothing was measured") && !shown.contains("does not fit"),
        "{shown}"
    );

    plays(4).await;
    site.evaluate(&alpha, &submission).await;
    play_slowly(&site, 300).await;
    site.next_day();
    assert_eq!(watch.look().await.unwrap(), [], "12 episodes fit");
    plays(1000).await;
    let warned = watch.look().await.unwrap();
    let days = |warned: &[faceoff_http::Overflow]| -> Vec<(String, bool)> {
        let days = warned.iter().map(|one| &one.load);
        days.map(|load| (load.day.to_string(), load.is_under_way))
            .collect()
    };
    assert_eq!(days(&warned), [("2026-03-02".to_owned(), false)]);
    assert_eq!(warned[0].stage.as_str(), "Qualifying");
    assert!(warned[0].load.summary.contains("does not fit"));
    assert_eq!(watch.look().await.unwrap(), [], "once");

    // On the page and in the views of stages, for organisers alone.
    for path in [
        "/api/v1/stages".to_owned(),
        format!("/api/v1/stages/{stage}"),
        "/api/v1/season".to_owned(),
    ] {
        let of_stage = |answer: Value| match path.as_str() {
            "/api/v1/stages" => answer[0].clone(),
            "/api/v1/season" => answer["stages"][0].clone(),
            _ => answer,
        };
        let seen = of_stage(site.get(&path, Some(ADMIN)).await.json(200));
        assert_eq!(seen["capacity"][0]["fit"], "not", "{path}");
        for token in [None, Some(alpha.token.as_str())] {
            let seen = of_stage(site.get(&path, token).await.json(200));
            assert_eq!(seen.get("capacity"), None, "{path}");
        }
    }
    let shown = page(Some(ADMIN)).await;
    assert!(
        shown.contains("does not fit") && shown.contains(&warned[0].load.summary),
        "{shown}"
    );
    assert!(!page(None).await.contains("Do the days fit"));

    // Again at the cut, of the day that is under way now; the next one is another.
    site.evaluate(&alpha, &submission).await;
    let warned = watch.look().await.unwrap();
    let expected = [
        ("2026-03-02".to_owned(), true),
        ("2026-03-03".to_owned(), false),
    ];
    assert_eq!(days(&warned), expected);
    lasts(100).await;
    assert_eq!(watch.look().await.unwrap(), []);
    lasts(1).await;
    assert_eq!(
        days(&watch.look().await.unwrap()),
        expected,
        "it fitted in between"
    );
    assert_eq!(watch.look().await.unwrap(), []);
}
