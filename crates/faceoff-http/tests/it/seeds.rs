//! Tests that a day's seed, and everything that depends on its episodes, stays secret until the day's release.

use crate::site::{ADMIN, Site, TestTeam, result};
use reqwest::Method;
use serde_json::{Value, json};

/// The texts of all responses about an evaluation that a visitor, its team or an organiser can read.
async fn visible_text(site: &Site, team: &TestTeam, evaluation: &str) -> String {
    let mut text = String::new();
    let public_paths = [
        "/",
        "/tasks/hit",
        "/season",
        "/api/v1/board",
        "/api/v1/season",
    ];
    for path in public_paths {
        text += &site.get(path, None).await.body;
    }
    text += &site
        .get(&evaluation.replace("/api/v1", ""), None)
        .await
        .body;
    for path in [evaluation, "/api/v1/evaluations", "/api/v1/me"] {
        text += &site.get(path, Some(&team.token)).await.body;
    }
    text += &site.get("/api/v1/evaluations", Some(ADMIN)).await.body;
    text
}

/// Requests a dataset by HEAD, GET and a range. Returns the statuses.
async fn dataset_statuses(site: &Site, dataset: &str, token: &str) -> [u16; 3] {
    let request_status = async |method: Method, range: bool| {
        let mut request = site.request(method, dataset, Some(token));
        if range {
            request = request.header("range", "bytes=0-0");
        }
        request.send().await.unwrap().status().as_u16()
    };
    [
        request_status(Method::HEAD, false).await,
        request_status(Method::GET, false).await,
        request_status(Method::GET, true).await,
    ]
}

#[tokio::test]
async fn seed_and_dataset_stay_secret_until_the_day_ends() {
    let site = Site::start().await;
    let teams = [site.team("First").await, site.team("Second").await];
    let submissions = [
        site.valid_submission(&teams[0], "f").await,
        site.valid_submission(&teams[1], "s").await,
    ];
    let [first, second] = &teams;
    let first_evaluation = site.start_evaluation(first, &submissions[0]).await;
    let second_evaluation = site.start_evaluation(second, &submissions[1]).await;
    let secret = site.store.season().await.unwrap().secret;
    let today = jiff::civil::date(2026, 3, 1);
    let seed = secret.stage(site.stage().await).day(today);
    let mut day_result = result([0.5, 0.6, 0.7], 100.0);
    day_result.seed = seed;
    site.finish_evaluation(&day_result).await;
    let dataset = format!("{first_evaluation}/dataset");

    // The second team's evaluation is queued in the first iteration. In the second one it has been started: a shard was claimed.
    for _ in 0..2 {
        let events = site.store.events_after(0, 1000).await.unwrap();
        for token in [&*first.token, ADMIN] {
            let refused = site.get(&dataset, Some(token)).await;
            let problem = refused.problem(409, "not-yet", &["1 evaluations of 2026-03-01"]);
            assert_eq!(problem["under_way"], 1);
            assert_eq!(refused.header("retry-after"), "30");
            assert_eq!(dataset_statuses(&site, &dataset, token).await, [409; 3]);
        }
        let visible_text = visible_text(&site, first, &first_evaluation).await;
        for part in [
            seed.to_string().as_str(),
            "computation_time_s",
            "violations\"",
            "host_noise_reruns",
        ] {
            assert!(!visible_text.contains(part), "{part}");
        }
        let later_events = site.store.events_after(0, 1000).await.unwrap();
        assert_eq!(later_events, events, "reading changes nothing");
        let (claim, ..) = site.claim_shard().await;
        site.store.release(&claim, site.now()).await.unwrap();
    }
    site.finish_evaluation(&day_result).await;
    // The day is released by the end of its last evaluation, not by a request.
    let finished = site
        .get(&first_evaluation, Some(&first.token))
        .await
        .json(200);
    assert_eq!(finished["result"]["seed"], seed.to_string());
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["seed"], seed.to_string());
    assert_eq!(
        dataset_statuses(&site, &dataset, &first.token).await,
        [200, 200, 206]
    );
    let second_id = second_evaluation.rsplit('/').next().unwrap();
    let compare = format!("{first_evaluation}/compare/{second_id}");
    assert_eq!(site.get(&compare, None).await.status, 200);

    // A later upload could exploit the known episodes, so it is evaluated on the next day, with another seed.
    let late = site.team("Late").await;
    let submission = site.valid_submission(&late, "l").await;
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(409, "cutoff-passed", &["2026-03-02"]);
    site.next_day();
    site.start_evaluation(&late, &submission).await;
    let next_seed = secret
        .stage(site.stage().await)
        .day(today.tomorrow().unwrap())
        .to_string();
    let visible_text = visible_text(&site, first, &first_evaluation).await;
    assert!(!visible_text.contains(&next_seed));
    // Yesterday's dataset stays available while today's evaluations run.
    assert_eq!(
        dataset_statuses(&site, &dataset, &first.token).await,
        [200, 200, 206]
    );
}

/// Starts an evaluation of each of these new teams. Returns also the paths of the evaluations in the API.
async fn start_evaluations(site: &Site, names: [&str; 3]) -> (Vec<TestTeam>, Vec<String>) {
    let (mut teams, mut submissions, mut paths) = (Vec::new(), Vec::new(), Vec::new());
    for name in names {
        let team = site.team(name).await;
        submissions.push(site.valid_submission(&team, "agent").await);
        teams.push(team);
    }
    for (team, submission) in teams.iter().zip(&submissions) {
        paths.push(site.start_evaluation(team, submission).await);
    }
    (teams, paths)
}

#[tokio::test]
async fn faults_log_and_comparison_appear_with_the_release() {
    let site = Site::start().await;
    let (teams, paths) = start_evaluations(&site, ["Failing", "Early", "Late"]).await;
    let [failing, early, late] = &paths[..] else {
        panic!("three evaluations")
    };
    // The plan of the run allows one agent fault, so two stop the first evaluation.
    site.run_shards_with_faults(2).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let compare = format!("{early}/compare/{}", late.rsplit('/').next().unwrap());
    for token in [&*teams[0].token, ADMIN] {
        let failed = site.get(failing, Some(token)).await;
        assert!(!failed.body.contains("log of ") && !failed.body.contains("\"act\""));
        let failed = failed.json(200);
        assert_eq!(failed["state"], "agent_failed");
        assert_eq!(failed["released_at"], json!(null));
        assert!(failed.get("faults").is_none() && failed.get("log").is_none());
    }
    site.finish_evaluation(&result([0.1, 0.1, 0.1], 0.0)).await;
    let failed = site.get(failing, Some(&teams[0].token)).await.json(200);
    assert_eq!(failed["faults"][0]["line"], "{\"type\":\"act\"}");
    assert!(failed["log"].as_str().unwrap().contains("log of "));
    assert_eq!(site.get(&compare, None).await.status, 200);
}

#[tokio::test]
async fn comparison_is_refused_while_the_day_is_open() {
    let site = Site::start().await;
    let (_, paths) = start_evaluations(&site, ["A", "B", "C"]).await;
    for _ in 0..2 {
        site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
            .await;
    }
    let compare = format!(
        "{}/compare/{}",
        paths[0],
        paths[1].rsplit('/').next().unwrap()
    );
    site.get(&compare, None)
        .await
        .problem(409, "not-yet", &["1 evaluations of 2026-03-01"]);
    let page = site.get(&paths[0].replace("/api/v1", ""), None).await;
    assert!(!page.body.contains("/compare/"), "{}", page.body);
    // The organiser cancels the last evaluation, which ends the day.
    let cancel = format!("{}/cancel", paths[2]);
    let reason = json!({ "reason": "it hangs" });
    site.post(&cancel, Some(ADMIN), &reason).await.json(200);
    assert_eq!(site.get(&compare, None).await.status, 200);
}

#[tokio::test]
async fn mismatch_seed_is_hidden_until_the_season_closes() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "a").await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    site.next_day();
    let secret = site.store.season().await.unwrap().secret;
    let visible_text = visible_text(&site, &team, &path).await;
    assert!(!visible_text.contains(&secret.model_mismatch().to_string()));
    assert!(!visible_text.contains(&secret.to_string()));
    let season: Value = site.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["mismatch_seed"], json!(null));
    let yesterday = jiff::civil::date(2026, 3, 1);
    assert_eq!(
        season["days"][0]["seed"],
        secret.stage(site.stage().await).day(yesterday).to_string()
    );
}
