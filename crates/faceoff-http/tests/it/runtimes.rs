//! Tests of runtimes, the environments in which agents run on the server, and of stages that accept only some runtimes.

use crate::site::{ADMIN, GZIP, Site, TestTeam, result, string};
use faceoff_store::Job;
use faceoff_testkit::valid_outcome;
use serde_json::{Value, json};

/// The events of excluded submissions.
const EXCLUSIONS_IN_LOG: &str = "/api/v1/events?kind=submission_not_taken";

/// Limits the first stage to these runtimes; null allows all.
async fn set_runtimes(site: &Site, runtimes: Value) -> Value {
    let body = json!({ "runtimes": runtimes, "confirm": "Qualifying" });
    site.change_first_stage(body).await.json(200)
}

/// Uploads a submission that is valid and uses this runtime. Returns its path in the API.
async fn valid_submission(site: &Site, team: &TestTeam, runtime: &str) -> String {
    let uploaded = site.upload(&team.token, GZIP.to_vec()).await.json(201);
    site.finish_validation(valid_outcome(runtime, "a", ""))
        .await;
    format!("/api/v1/submissions/{}", string(&uploaded["id"]))
}

#[tokio::test]
async fn runtimes_of_open_stages_are_sent_to_validation_runs() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    // The runtimes that a new validation run gets, by stage. None are sent if an open stage accepts all runtimes.
    let sent_runtimes = async || {
        site.upload(&team.token, GZIP.to_vec()).await.json(201);
        let Job::Validation { runtimes, .. } = site.claim().await.job else {
            panic!("expected a validation run");
        };
        let texts = runtimes
            .iter()
            .map(|accepted| format!("{}: {}", accepted.stage, accepted.runtimes));
        texts.collect::<Vec<_>>()
    };
    assert_eq!(sent_runtimes().await, [""; 0]);
    site.change_first_stage(json!({ "runtimes": ["python3"] }))
        .await
        .problem(409, "not-confirmed", &["revision 2"]);
    let changed = set_runtimes(&site, json!(["python3", "native", "python3"])).await;
    assert_eq!(changed["runtimes"], json!(["native", "python3"]));
    assert_eq!(changed["revision"], 2);
    assert_eq!(changed["revisions"][0].get("runtimes"), None);
    assert_eq!(sent_runtimes().await, ["Qualifying: native or python3"]);
    let page = site.get("/season", None).await.body;
    assert!(page.contains("only agents with the runtime native or python3"));

    // A new stage copies the settings of the open one, unless the request sets others. A stage that is not open yet does not
    // affect validation runs.
    let create_stage = async |body: Value| {
        site.post("/api/v1/stages", Some(ADMIN), &body)
            .await
            .json(201)
    };
    let upcoming_stage =
        json!({ "name": "Late", "opens_at": "2026-05-01T00:00:00Z", "runtimes": null });
    assert_eq!(create_stage(upcoming_stage).await.get("runtimes"), None);
    let copying_stage = json!({ "name": "Like", "opens_at": "2026-05-01T00:00:00Z" });
    assert_eq!(
        create_stage(copying_stage).await["runtimes"],
        changed["runtimes"]
    );
    assert_eq!(sent_runtimes().await.len(), 1);
    let second_open_stage = json!({ "name": "Beside", "runtimes": ["native"] });
    create_stage(second_open_stage).await;
    assert_eq!(
        sent_runtimes().await.len(),
        2,
        "one of the two stages may accept it"
    );
    create_stage(json!({ "name": "Open", "runtimes": null })).await;
    assert_eq!(
        sent_runtimes().await,
        [""; 0],
        "one of the open stages accepts all runtimes"
    );

    let changed = set_runtimes(&site, Value::Null).await;
    assert_eq!(
        (changed.get("runtimes"), &changed["revision"]),
        (None, &json!(3))
    );
}

#[tokio::test]
async fn excluded_runtime_is_not_evaluated_and_says_why() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    site.team("Gamma").await;
    let native = valid_submission(&site, &alpha, "native").await;
    valid_submission(&site, &beta, "python3").await;
    let stage = site.stage().await;
    let view = site.get(&native, Some(&alpha.token)).await.json(200);
    assert_eq!(
        (&view["runtime"], view.get("excluded_by")),
        (&json!("native"), None)
    );
    set_runtimes(&site, json!(["python3"])).await;
    let reason = "the stage “Qualifying” takes agents of the runtime python3 only, and this one names native in agent.toml";
    let excluded_by = json!([{ "stage": stage, "stage_name": "Qualifying", "reason": reason }]);

    // The submission may stay active: this stage may accept it later, or another stage does.
    let activate = format!("{native}/activate");
    let active = site
        .post(&activate, Some(&alpha.token), &json!({}))
        .await
        .json(200);
    assert_eq!(
        (&active["active"], &active["excluded_by"]),
        (&json!(true), &excluded_by)
    );
    assert!(string(&active["next"]).contains(reason), "{active}");
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["excluded_by"], excluded_by);
    let me = site.get("/api/v1/me", Some(&beta.token)).await.json(200);
    assert_eq!(me.get("excluded_by"), None);

    // A trial (an evaluation that does not count) of all active submissions skips the submission. A trial of it alone is refused.
    let trial = format!("/api/v1/stages/{stage}/trial");
    let id = native.rsplit('/').next().unwrap();
    let request = json!({ "reason": "?", "submission": id });
    site.post(&trial, Some(ADMIN), &request)
        .await
        .problem(409, "conflict", &[reason]);
    let trial_view = site
        .post(&trial, Some(ADMIN), &json!({ "reason": "?" }))
        .await
        .json(201);
    assert_eq!(trial_view["evaluations"].as_array().unwrap().len(), 1);
    let drop = format!("/api/v1/proposals/{}/drop", string(&trial_view["id"]));
    let confirm = json!({ "confirm": "Qualifying" });
    site.post(&drop, Some(ADMIN), &confirm).await.json(200);

    // The forecast and the cutoff count accepted submissions only.
    let capacity = format!("/api/v1/stages/{stage}/capacity");
    let capacity = site.get(&capacity, Some(ADMIN)).await.json(200);
    assert_eq!(capacity["days"][0]["teams"], 1);
    let day = site.start_day().await;
    let names = |list: &Value, key: &str| -> Vec<String> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|item| string(&item[key]))
            .collect()
    };
    assert_eq!(names(&day["created"], "team_name"), ["Beta"]);
    assert_eq!(names(&day["without_submission"], "name"), ["Gamma"]);
    assert_eq!(
        day["excluded"],
        json!([{ "team": alpha.id, "team_name": "Alpha", "submission": id, "reason": reason }])
    );
    let log = site.get(EXCLUSIONS_IN_LOG, Some(ADMIN)).await.json(200);
    assert_eq!(log["events"][0]["subject"], format!("submission:{id}"));
    assert_eq!(
        log["events"][0]["details"],
        json!({ "stage": stage, "day": "2026-03-01", "reason": reason })
    );
    let extra = format!("/api/v1/stages/{stage}/days/2026-03-01/extra-evaluation");
    let request = json!({ "team": alpha.id, "reason": "?" });
    site.post(&extra, Some(ADMIN), &request)
        .await
        .problem(409, "conflict", &[reason]);
    let penalty_points = 10.0;
    site.finish_evaluation(&result([0.5; 3], penalty_points))
        .await;
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(
        me["today"]["evaluation"],
        Value::Null,
        "no evaluation was created"
    );

    // Rules that accept none of the day's agents allow no re-evaluation.
    set_runtimes(&site, json!(["native"])).await;
    let proposals = format!("/api/v1/stages/{stage}/proposals");
    let request = json!({ "day": "2026-03-01", "new_rules": true, "reason": "?" });
    site.post(&proposals, Some(ADMIN), &request).await.problem(
        409,
        "conflict",
        &["not accepted by these rules"],
    );
    site.next_day();
    let day = site.start_day().await;
    assert_eq!(names(&day["created"], "team_name"), ["Alpha"]);
}

#[tokio::test]
async fn day_without_accepted_submission_can_still_be_started() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    valid_submission(&site, &team, "native").await;
    set_runtimes(&site, json!(["python3"])).await;
    for _ in ["first attempt", "second attempt"] {
        site.post("/api/v1/days", Some(ADMIN), &json!({}))
            .await
            .problem(
                409,
                "conflict",
                &["that the stage accepts", "its cutoff is still available"],
            );
    }
    let log = site.get(EXCLUSIONS_IN_LOG, Some(ADMIN)).await.json(200);
    assert_eq!(log["events"], json!([]));
    set_runtimes(&site, json!(null)).await;
    let day = site.start_day().await;
    assert_eq!(day["created"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn invalid_runtimes_are_refused_by_name() {
    let site = Site::start().await;
    let before = site.get("/api/v1/stages", None).await.json(200);
    for (runtimes, words) in [
        (json!([]), &["runtimes", "one runtime at least", "null"][..]),
        (
            json!(["julia"]),
            &["runtimes", "native, python3", "\"julia\""],
        ),
        (
            json!(["native", "../x"]),
            &["runtimes", "dots, dashes", "../x"],
        ),
        (json!("native"), &["runtimes", "sequence"]),
        (json!([1]), &["runtimes", "string"]),
        (json!({ "native": true }), &["runtimes"]),
    ] {
        let body = json!({ "runtimes": runtimes, "confirm": "Qualifying" });
        site.change_first_stage(body)
            .await
            .problem(422, "invalid-content", words);
        let new_stage = json!({ "name": "Final", "runtimes": runtimes });
        site.post("/api/v1/stages", Some(ADMIN), &new_stage)
            .await
            .problem(422, "invalid-content", words);
    }
    assert_eq!(site.get("/api/v1/stages", None).await.json(200), before);
}

#[tokio::test]
async fn agent_environment_is_public() {
    let site = Site::start().await;
    let view = site.get("/api/v1/runtimes", None).await.json(200);
    assert_eq!(view["gpu"], "none");
    assert_eq!(view["network"], "none");
    assert_eq!(
        view["machine"],
        json!({ "architecture": "x86_64", "cpu_model": "A CPU", "cpus_per_agent": 1 })
    );
    assert_eq!(
        view["runtimes"][0],
        json!({ "name": "native", "kind": "native", "libc": null })
    );
    assert_eq!(view["runtimes"][1]["version"], "3.11.2");
    assert_eq!(view["runtimes"][1]["packages"]["numpy"], "2.4.6");
    assert_eq!(view["runtimes"][2]["kind"], "broken");
    // The reason why the third runtime is broken contains a path of the server, `/secret/folder`.
    assert!(!view.to_string().contains("secret"), "{view}");
    assert_eq!(view["limits"]["resources"]["memory_bytes"], 2_u64 << 30);
    assert_eq!(view["stages"][0]["limits"], view["limits"]);
    assert_eq!(
        view["stages"][0]["runtimes"],
        json!(["native", "python3", "wrong"])
    );

    // Stages and tournaments have limits and runtimes of their own.
    let settings = json!({
        "runtimes": ["python3"], "limits": { "memory_bytes": 536_870_912, "step_s": 0.25 },
        "confirm": "Qualifying",
    });
    site.change_first_stage(settings).await.json(200);
    site.team("Alpha").await;
    let rules = json!({ "runtimes": ["native"], "limits": { "pids": 16 } });
    let cup = json!({ "name": "Cup", "teams": ["Alpha"], "rules": rules });
    site.post("/api/v1/tournaments", Some(ADMIN), &cup)
        .await
        .json(201);
    let view = site.get("/api/v1/runtimes", None).await.json(200);
    let (stage, cup) = (&view["stages"][0], &view["tournaments"][0]);
    assert_eq!(stage["runtimes"], json!(["python3"]));
    assert_eq!(stage["limits"]["resources"]["memory_bytes"], 536_870_912);
    assert_eq!(stage["limits"]["time"]["step_s"], 0.25);
    assert_eq!(stage["limits"]["time"]["reset_s"], 10.0);
    assert_eq!(view["limits"]["time"]["step_s"], 1.0);
    assert_eq!(cup["runtimes"], json!(["native"]));
    assert_eq!(cup["limits"]["resources"]["pids"], 16);
    assert_eq!(cup["game_limits"]["in_time_s"], 0.02);

    let page = site.get("/help", None).await;
    assert_eq!(page.status, 200);
    for words in [
        "CPython 3.11.2",
        "numpy&nbsp;2.4.6",
        "512 MiB",
        "0.25 s",
        "A CPU",
        "Qualifying",
        "Cup",
        "does not work",
        "--like-server",
        "/api/v1/runtimes",
    ] {
        assert!(page.body.contains(words), "{words}: {}", page.body);
    }
    // A package is named `<b>odd</b>`, which the page must escape.
    assert!(!page.body.contains("<b>odd") && !page.body.contains("secret"));
    let board = site.get("/", None).await.body;
    assert!(board.contains("href=\"/help\""));
}

#[tokio::test]
async fn closed_stage_lists_no_runtimes() {
    let site = Site::start().await;
    let stages = async || {
        let view = site.get("/api/v1/runtimes", None).await.json(200);
        view["stages"].as_array().unwrap().len()
    };
    assert_eq!(stages().await, 1);
    let closing = json!({ "closes_at": "2026-03-01T23:00:00Z" });
    site.change_first_stage(closing).await.json(200);
    site.next_day();
    assert_eq!(stages().await, 0);
    let page = site.get("/help", None).await.body;
    assert!(page.contains("No stage"), "{page}");
}
