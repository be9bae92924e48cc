//! Tests of remote workers (processes on other machines that run jobs), as organisers see them on pages and in the API.

use crate::{
    browser::Browser,
    html::{links, texts},
    site::{ADMIN, Site},
    team_dashboard::{dashboard_page, redirect_target},
};
use faceoff_live::{SlotReport, WorkerInfo};
use serde_json::{Value, json};
use uuid::Uuid;

fn worker_info(version: &str, slots: u32) -> WorkerInfo {
    WorkerInfo {
        version: version.to_owned(),
        slots,
        labels: vec!["lab <3>".to_owned()],
    }
}

#[tokio::test]
async fn remote_workers_are_listed_with_jobs_and_problems() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    let worker_list = async || site.get("/api/v1/workers", Some(ADMIN)).await.json(200);
    let without_workers = worker_list().await;
    assert_eq!(
        (
            &without_workers["own_slots"],
            &without_workers["leases_jobs"]
        ),
        (&json!(2), &json!(false))
    );
    let html = dashboard_page(&grace.open("/organiser/workers").await, 200);
    assert!(texts(&html, "main")[0].contains("Remote workers are turned off"));

    let (workers, job) = (site.live.workers.clone(), Uuid::from_u128(7));
    workers.enable();
    workers.record_poll("rack-1", worker_info("1.0", 4), None, site.now());
    workers.record_poll(
        "rack-2",
        worker_info("0.9", 8),
        Some("the worker runs another <program>"),
        site.now(),
    );
    workers.record_job(
        "rack-1",
        "slot-2",
        job,
        SlotReport {
            description: Some("hit episodes 0 to 49"),
            problem: None,
        },
        site.now(),
    );
    let with_workers = worker_list().await;
    assert_eq!(
        with_workers["remote_slots"], 4,
        "a refused worker runs no jobs"
    );
    let worker_states = |list: &Value| {
        let workers = list["workers"].as_array().unwrap().iter();
        workers
            .map(|worker| worker["state"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(worker_states(&with_workers), ["working", "refused"]);
    let busy = &with_workers["workers"][0]["busy"][0];
    assert_eq!(
        (&busy["slot"], &busy["is_long"]),
        (&json!("slot-2"), &json!(false))
    );
    let html = dashboard_page(&grace.open("/organiser/workers").await, 200);
    let rows = texts(&html, "tbody tr");
    assert!(
        rows[0].contains("rack-1")
            && rows[0].contains("lab <3>")
            && rows[0].contains("slot-2: hit episodes 0 to 49"),
        "{rows:?}"
    );
    assert!(
        rows[1].contains("gets no jobs") && rows[1].contains("another <program>"),
        "{rows:?}"
    );
    let metrics = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(metrics.contains("faceoff_remote_slots 4\n"), "{metrics}");
    assert!(metrics.contains("faceoff_remote_workers 2\n"), "{metrics}");

    // After half a minute without contact, the workers are silent. After an hour, the job is reported as long.
    site.advance(30);
    assert_eq!(worker_states(&worker_list().await), ["silent", "silent"]);
    assert_eq!(worker_list().await["remote_slots"], 0);
    site.advance(3600);
    let with_problem = SlotReport {
        description: None,
        problem: Some("the stream is <full>"),
    };
    workers.record_job("rack-1", "slot-2", job, with_problem, site.now());
    let with_workers = worker_list().await;
    let busy = &with_workers["workers"][0]["busy"][0];
    assert_eq!(
        (&busy["is_long"], &busy["problem"]),
        (&json!(true), &json!("the stream is <full>"))
    );
    let job_name = format!("rack-1/slot-2, job {job} (hit episodes 0 to 49)");
    let alarm = format!("A job has been running for more than an hour: {job_name}");
    let problem =
        format!("A worker cannot send the result of a job: {job_name}: the stream is <full>");
    assert_eq!(
        (&with_workers["alarms"], &with_workers["problems"]),
        (&json!([alarm]), &json!([problem]))
    );
    for path in ["/organiser", "/organiser/workers"] {
        let html = dashboard_page(&grace.open(path).await, 200);
        let main = &texts(&html, "main")[0];
        assert!(main.contains(&alarm) && main.contains(&problem), "{main}");
    }
    workers.record_job("rack-1", "slot-2", job, SlotReport::default(), site.now());
    assert_eq!(worker_list().await["problems"], json!([]));
    let metrics = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(
        metrics.contains("faceoff_remote_long_units 1\n"),
        "{metrics}"
    );
    workers.end_job(job);
    assert_eq!(worker_states(&worker_list().await), ["idle", "silent"]);

    workers.set_problem("publish jobs", Some("no connection to <NATS>"));
    let list = worker_list().await;
    assert_eq!(
        list["problems"],
        json!(["The server cannot publish jobs: no connection to <NATS>"])
    );
    for path in ["/organiser", "/organiser/workers"] {
        let html = dashboard_page(&grace.open(path).await, 200);
        assert!(
            texts(&html, "main")[0].contains("no connection to <NATS>"),
            "{path}"
        );
    }
    // The server has slots of its own, so it is ready.
    site.get("/api/v1/health", None).await.json(200);
}

#[tokio::test]
async fn worker_is_banned_and_readmitted_on_page_and_in_the_api() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    let workers = site.live.workers.clone();
    workers.enable();
    workers.record_poll("rack-1", worker_info("1.0", 4), None, site.now());
    workers.record_job(
        "rack-1",
        "slot-2",
        Uuid::from_u128(7),
        SlotReport::default(),
        site.now(),
    );
    let ban_reason = async |name: &str| {
        let name = name.parse().unwrap();
        site.store.ban_reason(&name).await.unwrap()
    };
    let html = dashboard_page(&grace.open("/organiser/workers").await, 200);
    assert_eq!(
        links(&html, "a[href='/organiser/decide/ban/rack-1']").len(),
        1
    );

    // A ban needs a reason, and a valid name of a worker.
    let ban = "/organiser/decide/ban/rack-1";
    let refused = grace.submit(ban, &[("reason", " ")]).await;
    assert_eq!(refused.status, 422);
    assert_eq!(
        grace.open("/organiser/decide/ban/rack%201").await.status,
        404
    );
    let reason = "its memory is <broken>";
    let banned = grace.submit(ban, &[("reason", reason)]).await;
    let html = dashboard_page(&grace.open(&redirect_target(&banned)).await, 200);
    let main = &texts(&html, "main")[0];
    assert!(
        main.contains("The worker is banned") && main.contains(reason),
        "{main}"
    );
    assert_eq!(ban_reason("rack-1").await.as_deref(), Some(reason));
    let attention = dashboard_page(&grace.open("/organiser").await, 200);
    assert!(texts(&attention, "main")[0].contains("The worker rack-1 is banned"));
    let worker_list = site.get("/api/v1/workers", Some(ADMIN)).await.json(200);
    assert_eq!(
        worker_list["workers"][0]["busy"],
        json!([]),
        "its job is queued again"
    );
    let bans = &worker_list["bans"];
    assert_eq!(
        (
            &bans[0]["worker"],
            &bans[0]["reason"],
            &bans[0]["evaluations"]
        ),
        (&json!("rack-1"), &json!(reason), &json!([])),
        "no evaluation that counts has a part that the worker ran"
    );

    let post = async |path: &str, body: Value| {
        site.post(&format!("/api/v1/workers/{path}"), Some(ADMIN), &body)
            .await
    };
    let again = post("rack-1/ban", json!({ "reason": "once more" })).await;
    again.problem(409, "conflict", &["banned already"]);
    assert_eq!(post("rack-1/readmit", json!({})).await.status, 204);
    assert_eq!(ban_reason("rack-1").await, None);
    post("rack-1/readmit", json!({}))
        .await
        .problem(409, "conflict", &["is not banned"]);
    post("rack.1/ban", json!({ "reason": "x" }))
        .await
        .problem(404, "not-found", &[]);
    assert_eq!(
        post("rack-2/ban", json!({ "reason": "x" })).await.status,
        204
    );
    let readmit = grace.submit("/organiser/decide/readmit/rack-2", &[]).await;
    let html = dashboard_page(&grace.open(&redirect_target(&readmit)).await, 200);
    assert!(texts(&html, "main")[0].contains("readmitted"));
    assert_eq!(ban_reason("rack-2").await, None);
}
