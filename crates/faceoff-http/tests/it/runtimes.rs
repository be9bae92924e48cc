//! What agents find on a server, and stages that take agents of some runtimes only.

use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, result, text};
use faceoff_store::Work;
use faceoff_types::SmokeOutcome;
use reqwest::Method;
use serde_json::{Value, json};

async fn change(site: &Site, body: Value) -> Answer {
    let path = format!("/api/v1/stages/{}", site.stage().await);
    let request = site.request(Method::PATCH, &path, Some(ADMIN));
    Answer::of(request.json(&body).send().await.unwrap()).await
}

/// Has the first stage take these only; null: all.
async fn takes(site: &Site, runtimes: Value) -> Value {
    let body = json!({ "runtimes": runtimes, "confirm": "Qualifying" });
    change(site, body).await.json(200)
}

/// A submission that was found valid, of an agent of this runtime; its path in the API.
async fn valid(site: &Site, team: &TestTeam, runtime: &str) -> String {
    let uploaded = site.upload(&team.token, GZIP.to_vec()).await.json(201);
    site.smoke(SmokeOutcome::Valid {
        agent_name: "a".into(),
        runtime: runtime.into(),
        timing: Vec::new(),
        log: String::new(),
    })
    .await;
    format!("/api/v1/submissions/{}", text(&uploaded["id"]))
}

#[tokio::test]
async fn runtimes_are_rules_which_the_smoke_run_of_an_upload_is_told() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let told = async || {
        site.upload(&team.token, GZIP.to_vec()).await.json(201);
        let Work::Smoke { runtimes, .. } = site.claim().await.work else {
            panic!("expected a smoke run");
        };
        let told = runtimes
            .iter()
            .map(|one| format!("{}: {}", one.stage, one.runtimes));
        told.collect::<Vec<_>>()
    };
    assert_eq!(told().await, [""; 0]);
    change(&site, json!({ "runtimes": ["python3"] }))
        .await
        .problem(409, "not-confirmed", &["revision 2"]);
    let changed = takes(&site, json!(["python3", "native", "python3"])).await;
    assert_eq!(changed["runtimes"], json!(["native", "python3"]));
    assert_eq!(changed["revision"], 2);
    assert_eq!(changed["revisions"][0].get("runtimes"), None);
    assert_eq!(told().await, ["Qualifying: native or python3"]);
    let page = site.get("/season", None).await.body;
    assert!(page.contains("agents of the runtime native or python3 only"));

    // A stage is made like the one that is open, unless it says otherwise; one that opens later counts for nothing yet.
    let make = async |body: Value| {
        site.post("/api/v1/stages", Some(ADMIN), &body)
            .await
            .json(201)
    };
    let later = json!({ "name": "Late", "opens_at": "2026-05-01T00:00:00Z", "runtimes": null });
    assert_eq!(make(later).await.get("runtimes"), None);
    let like = json!({ "name": "Like", "opens_at": "2026-05-01T00:00:00Z" });
    assert_eq!(make(like).await["runtimes"], changed["runtimes"]);
    assert_eq!(told().await.len(), 1);
    let beside = json!({ "name": "Beside", "runtimes": ["native"] });
    make(beside).await;
    assert_eq!(told().await.len(), 2, "either may take it");
    make(json!({ "name": "Open", "runtimes": null })).await;
    assert_eq!(told().await, [""; 0], "one of the open ones takes all");

    let all = takes(&site, Value::Null).await;
    assert_eq!((all.get("runtimes"), &all["revision"]), (None, &json!(3)));
}

#[tokio::test]
async fn what_a_stage_does_not_take_is_not_played_there_and_says_why() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    site.team("Gamma").await;
    let native = valid(&site, &alpha, "native").await;
    valid(&site, &beta, "python3").await;
    let stage = site.stage().await;
    let seen = site.get(&native, Some(&alpha.token)).await.json(200);
    assert_eq!(
        (&seen["runtime"], seen.get("not_taken")),
        (&json!("native"), None)
    );
    takes(&site, json!(["python3"])).await;
    let why = "the stage “Qualifying” takes agents of the runtime python3 only, and this one names native in agent.toml";
    let not_taken = json!([{ "stage": stage, "stage_name": "Qualifying", "reason": why }]);

    // It may be active: the stage may take it again, or another.
    let activate = format!("{native}/activate");
    let active = site
        .post(&activate, Some(&alpha.token), &json!({}))
        .await
        .json(200);
    assert_eq!(
        (&active["active"], &active["not_taken"]),
        (&json!(true), &not_taken)
    );
    assert!(text(&active["next"]).contains(why), "{active}");
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["not_taken"], not_taken);
    let me = site.get("/api/v1/me", Some(&beta.token)).await.json(200);
    assert_eq!(me.get("not_taken"), None);

    // The trial of what is active leaves it out; asked for by itself it is refused.
    let trial = format!("/api/v1/stages/{stage}/trial");
    let id = native.rsplit('/').next().unwrap();
    let wanted = json!({ "reason": "?", "submission": id });
    site.post(&trial, Some(ADMIN), &wanted)
        .await
        .problem(409, "conflict", &[why]);
    let tried = site
        .post(&trial, Some(ADMIN), &json!({ "reason": "?" }))
        .await
        .json(201);
    assert_eq!(tried["evaluations"].as_array().unwrap().len(), 1);
    let drop = format!("/api/v1/proposals/{}/drop", text(&tried["id"]));
    let confirm = json!({ "confirm": "Qualifying" });
    site.post(&drop, Some(ADMIN), &confirm).await.json(200);

    // The forecast counts whom the stage takes, and so does the cut.
    let capacity = format!("/api/v1/stages/{stage}/capacity");
    let capacity = site.get(&capacity, Some(ADMIN)).await.json(200);
    assert_eq!(capacity["days"][0]["teams"], 1);
    let day = site
        .post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    let names = |list: &Value, key: &str| -> Vec<String> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|one| text(&one[key]))
            .collect()
    };
    assert_eq!(names(&day["created"], "team_name"), ["Beta"]);
    assert_eq!(names(&day["without_submission"], "name"), ["Gamma"]);
    assert_eq!(
        day["not_taken"],
        json!([{ "team": alpha.id, "team_name": "Alpha", "submission": id, "reason": why }])
    );
    let logged = "/api/v1/events?kind=submission_not_taken";
    let logged = site.get(logged, Some(ADMIN)).await.json(200);
    assert_eq!(logged["events"][0]["subject"], format!("submission:{id}"));
    assert_eq!(
        logged["events"][0]["details"],
        json!({ "stage": stage, "day": "2026-03-01", "reason": why })
    );
    let extra = format!("/api/v1/stages/{stage}/days/2026-03-01/extra-turn");
    let wanted = json!({ "team": alpha.id, "reason": "?" });
    site.post(&extra, Some(ADMIN), &wanted)
        .await
        .problem(409, "conflict", &[why]);
    site.finish(&result([0.5; 3], 10.0)).await;
    let me = site.get("/api/v1/me", Some(&alpha.token)).await.json(200);
    assert_eq!(me["turn"]["evaluation"], Value::Null, "no turn was taken");

    // By rules that take none of the day's agents nothing is evaluated again.
    takes(&site, json!(["native"])).await;
    let again = format!("/api/v1/stages/{stage}/proposals");
    let wanted = json!({ "day": "2026-03-01", "new_rules": true, "reason": "?" });
    site.post(&again, Some(ADMIN), &wanted).await.problem(
        409,
        "conflict",
        &["agents that these do not take"],
    );
    site.next_day();
    let day = site
        .post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(names(&day["created"], "team_name"), ["Alpha"]);
}

#[tokio::test]
async fn a_day_that_nobody_could_play_keeps_its_cut() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    valid(&site, &team, "native").await;
    takes(&site, json!(["python3"])).await;
    for _ in ["nothing is done", "so it is the same again"] {
        site.post("/api/v1/days", Some(ADMIN), &json!({}))
            .await
            .problem(
                409,
                "conflict",
                &["that the stage takes", "still has its cut"],
            );
    }
    let logged = "/api/v1/events?kind=submission_not_taken";
    let logged = site.get(logged, Some(ADMIN)).await.json(200);
    assert_eq!(logged["events"], json!([]));
    takes(&site, json!(null)).await;
    let day = site
        .post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(day["created"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn wrong_runtimes_are_refused_by_name() {
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
        change(&site, body)
            .await
            .problem(422, "invalid-content", words);
        let new = json!({ "name": "Final", "runtimes": runtimes });
        site.post("/api/v1/stages", Some(ADMIN), &new)
            .await
            .problem(422, "invalid-content", words);
    }
    assert_eq!(site.get("/api/v1/stages", None).await.json(200), before);
}

#[tokio::test]
async fn everybody_may_know_what_agents_find_here() {
    let site = Site::start().await;
    let told = site.get("/api/v1/runtimes", None).await.json(200);
    assert_eq!(told["gpu"], "none");
    assert_eq!(told["network"], "none");
    assert_eq!(
        told["machine"],
        json!({ "architecture": "x86_64", "cpu_model": "A CPU", "cpus_per_agent": 1 })
    );
    assert_eq!(
        told["runtimes"][0],
        json!({ "name": "native", "kind": "native", "libc": null })
    );
    assert_eq!(told["runtimes"][1]["version"], "3.11.2");
    assert_eq!(told["runtimes"][1]["packages"]["numpy"], "2.4.6");
    assert_eq!(told["runtimes"][2]["kind"], "broken");
    assert!(!told.to_string().contains("secret"), "{told}");
    assert_eq!(told["limits"]["resources"]["memory_bytes"], 2_u64 << 30);
    assert_eq!(told["stages"][0]["limits"], told["limits"]);
    assert_eq!(
        told["stages"][0]["runtimes"],
        json!(["native", "python3", "wrong"])
    );

    // A stage has limits and runtimes of its own, and so has a tournament.
    let own = json!({
        "runtimes": ["python3"], "limits": { "memory_bytes": 536_870_912, "step_s": 0.25 },
        "confirm": "Qualifying",
    });
    change(&site, own).await.json(200);
    site.team("Alpha").await;
    let rules = json!({ "runtimes": ["native"], "limits": { "pids": 16 } });
    let cup = json!({ "name": "Cup", "teams": ["Alpha"], "rules": rules });
    site.post("/api/v1/tournaments", Some(ADMIN), &cup)
        .await
        .json(201);
    let told = site.get("/api/v1/runtimes", None).await.json(200);
    let (stage, cup) = (&told["stages"][0], &told["tournaments"][0]);
    assert_eq!(stage["runtimes"], json!(["python3"]));
    assert_eq!(stage["limits"]["resources"]["memory_bytes"], 536_870_912);
    assert_eq!(stage["limits"]["time"]["step_s"], 0.25);
    assert_eq!(stage["limits"]["time"]["reset_s"], 10.0);
    assert_eq!(told["limits"]["time"]["step_s"], 1.0);
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
    assert!(!page.body.contains("<b>odd") && !page.body.contains("secret"));
    let board = site.get("/", None).await.body;
    assert!(board.contains("href=\"/help\""));
}

#[tokio::test]
async fn a_stage_that_is_over_offers_nothing() {
    let site = Site::start().await;
    let stages = async || {
        let told = site.get("/api/v1/runtimes", None).await.json(200);
        told["stages"].as_array().unwrap().len()
    };
    assert_eq!(stages().await, 1);
    let over = json!({ "closes_at": "2026-03-01T23:00:00Z" });
    change(&site, over).await.json(200);
    site.next_day();
    assert_eq!(stages().await, 0);
    let page = site.get("/help", None).await.body;
    assert!(page.contains("No stage"), "{page}");
}
