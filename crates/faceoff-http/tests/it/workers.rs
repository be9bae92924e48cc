//! Who plays on other machines, as organisers see it.

use crate::{
    browser::Browser,
    desk::{led, links, shown},
    html::texts,
    site::{ADMIN, Site},
};
use faceoff_store::{WorkTold, WorkerAbout};
use serde_json::{Value, json};
use uuid::Uuid;

fn about(version: &str, slots: u32) -> WorkerAbout {
    WorkerAbout {
        version: version.to_owned(),
        slots,
        labels: vec!["lab <3>".to_owned()],
    }
}

#[tokio::test]
async fn organisers_see_who_plays_elsewhere_and_what_keeps_others_from_it() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::joined(&site, "Grace", role).await;
    let told = async || site.get("/api/v1/workers", Some(ADMIN)).await.json(200);
    let none = told().await;
    assert_eq!(
        (&none["own_slots"], &none["is_given"]),
        (&json!(2), &json!(false))
    );
    let html = shown(&grace.open("/organiser/workers").await, 200);
    assert!(texts(&html, "main")[0].contains("No work is given to other machines"));

    let (workers, unit) = (site.store.workers().clone(), Uuid::from_u128(7));
    workers.use_them();
    workers.heard("rack-1", about("1.0", 4), None, site.now());
    workers.heard(
        "rack-2",
        about("0.9", 8),
        Some("the worker runs another <program>"),
        site.now(),
    );
    workers.works(
        "rack-1",
        "slot-2",
        unit,
        WorkTold {
            what: Some("hit episodes 0 to 49"),
            trouble: None,
        },
        site.now(),
    );
    let all = told().await;
    assert_eq!(all["remote_slots"], 4, "who is refused plays nothing");
    let states = |of: &Value| {
        let workers = of["workers"].as_array().unwrap().iter();
        workers
            .map(|worker| worker["state"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(states(&all), ["working", "refused"]);
    let busy = &all["workers"][0]["busy"][0];
    assert_eq!(
        (&busy["slot"], &busy["is_long"]),
        (&json!("slot-2"), &json!(false))
    );
    let html = shown(&grace.open("/organiser/workers").await, 200);
    let rows = texts(&html, "tbody tr");
    assert!(
        rows[0].contains("rack-1")
            && rows[0].contains("lab <3>")
            && rows[0].contains("slot-2: hit episodes 0 to 49"),
        "{rows:?}"
    );
    assert!(
        rows[1].contains("gets no work") && rows[1].contains("another <program>"),
        "{rows:?}"
    );
    let metrics = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(metrics.contains("faceoff_remote_slots 4\n"), "{metrics}");
    assert!(metrics.contains("faceoff_remote_workers 2\n"), "{metrics}");

    // Half a minute later nothing more was heard of them; the unit is worth a look after an hour.
    site.later(30);
    assert_eq!(states(&told().await), ["silent", "silent"]);
    assert_eq!(told().await["remote_slots"], 0);
    site.later(3600);
    let stuck = WorkTold {
        what: None,
        trouble: Some("the stream is <full>"),
    };
    workers.works("rack-1", "slot-2", unit, stuck, site.now());
    let all = told().await;
    let busy = &all["workers"][0]["busy"][0];
    assert_eq!(
        (&busy["is_long"], &busy["trouble"]),
        (&json!(true), &json!("the stream is <full>"))
    );
    let named = format!("rack-1/slot-2, unit {unit} (hit episodes 0 to 49)");
    let alarm = format!("A worker takes more than an hour: {named}");
    let trouble =
        format!("A worker cannot hand in what it has played: {named}: the stream is <full>");
    assert_eq!(
        (&all["alarms"], &all["troubles"]),
        (&json!([alarm]), &json!([trouble]))
    );
    for path in ["/organiser", "/organiser/workers"] {
        let html = shown(&grace.open(path).await, 200);
        let main = &texts(&html, "main")[0];
        assert!(main.contains(&alarm) && main.contains(&trouble), "{main}");
    }
    workers.works("rack-1", "slot-2", unit, WorkTold::default(), site.now());
    assert_eq!(told().await["troubles"], json!([]));
    let metrics = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(
        metrics.contains("faceoff_remote_long_units 1\n"),
        "{metrics}"
    );
    workers.ended(unit);
    assert_eq!(states(&told().await), ["idle", "silent"]);

    workers.trouble("give out work", Some("no connection to <NATS>"));
    let told = told().await;
    assert_eq!(
        told["troubles"],
        json!(["The server cannot give out work: no connection to <NATS>"])
    );
    for path in ["/organiser", "/organiser/workers"] {
        let html = shown(&grace.open(path).await, 200);
        assert!(
            texts(&html, "main")[0].contains("no connection to <NATS>"),
            "{path}"
        );
    }
    // Its own slots play: it is fit for work.
    site.get("/api/v1/health", None).await.json(200);
}

#[tokio::test]
async fn organisers_ban_a_worker_and_readmit_it_by_the_desk_and_the_api() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::joined(&site, "Grace", role).await;
    let workers = site.store.workers().clone();
    workers.use_them();
    workers.heard("rack-1", about("1.0", 4), None, site.now());
    let html = shown(&grace.open("/organiser/workers").await, 200);
    assert_eq!(
        links(&html, "a[href='/organiser/decide/ban/rack-1']").len(),
        1
    );

    // No reason, no ban; a name that no worker can have is no decision.
    let ban = "/organiser/decide/ban/rack-1";
    let refused = grace.submit(ban, &[("reason", " ")]).await;
    assert_eq!(refused.status, 422);
    assert_eq!(
        grace.open("/organiser/decide/ban/rack%201").await.status,
        404
    );
    let reason = "its memory is <broken>";
    let done = grace.submit(ban, &[("reason", reason)]).await;
    let html = shown(&grace.open(&led(&done)).await, 200);
    let main = &texts(&html, "main")[0];
    assert!(
        main.contains("The worker is banned") && main.contains(reason),
        "{main}"
    );
    assert_eq!(workers.ban_of("rack-1").as_deref(), Some(reason));
    let attention = shown(&grace.open("/organiser").await, 200);
    assert!(texts(&attention, "main")[0].contains("The worker rack-1 is banned"));
    let told = site.get("/api/v1/workers", Some(ADMIN)).await.json(200);
    let bans = &told["bans"];
    assert_eq!(
        (
            &bans[0]["worker"],
            &bans[0]["reason"],
            &bans[0]["evaluations"]
        ),
        (&json!("rack-1"), &json!(reason), &json!([]))
    );

    let post = async |path: &str, body: Value| {
        site.post(&format!("/api/v1/workers/{path}"), Some(ADMIN), &body)
            .await
    };
    let again = post("rack-1/ban", json!({ "reason": "once more" })).await;
    again.problem(409, "conflict", &["banned already"]);
    assert_eq!(post("rack-1/readmit", json!({})).await.status, 204);
    assert_eq!(workers.ban_of("rack-1"), None);
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
    let html = shown(&grace.open(&led(&readmit)).await, 200);
    assert!(texts(&html, "main")[0].contains("readmitted"));
    assert_eq!(workers.ban_of("rack-2"), None);
}
