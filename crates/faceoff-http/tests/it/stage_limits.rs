//! Tests of the agent limits and upload quotas of a stage. Limits that the stage does not set are those of the server.

use crate::site::{GZIP, Site};
use faceoff_store::Job;
use serde_json::json;

#[tokio::test]
async fn stage_limits_are_rules_and_apply_to_validation_runs() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let before = site.get("/api/v1/stages", None).await.json(200)[0].clone();
    assert_eq!((before.get("limits"), before.get("uploads")), (None, None));
    let limits = json!({ "limits": { "memory_bytes": 67108864, "step_s": 0.5 } });
    site.change_first_stage(limits.clone())
        .await
        .problem(409, "not-confirmed", &["revision 2"]);
    let mut limits = limits;
    limits["confirm"] = json!("Qualifying");
    let changed = site.change_first_stage(limits).await.json(200);
    assert_eq!(
        changed["limits"],
        json!({ "memory_bytes": 67108864, "step_s": 0.5 })
    );
    assert_eq!(changed["revision"], 2);
    assert_eq!(changed["revisions"][0].get("limits"), None);
    site.upload(&team.token, GZIP.to_vec()).await.json(201);
    let Job::Validation {
        ruleset_and_plan, ..
    } = site.claim().await.job
    else {
        panic!("expected a validation run");
    };
    let (_, plan) = *ruleset_and_plan.expect("the stage is open");
    let limits = &plan.limits;
    assert_eq!((limits.memory_bytes, limits.pids), (Some(64 << 20), None));
    assert_eq!(json!(plan.tasks), changed["tasks"]);
    assert_eq!(json!(plan.episodes_per_task), changed["episodes_per_task"]);
    assert_eq!(
        json!(plan.episodes_per_shard),
        changed["episodes_per_shard"]
    );
    // An empty object restores the server's limits.
    let no_limits = json!({ "limits": {}, "confirm": "Qualifying" });
    assert_eq!(
        site.change_first_stage(no_limits)
            .await
            .json(200)
            .get("limits"),
        None
    );
}

#[tokio::test]
async fn upload_quotas_are_those_of_the_open_stage() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let quotas = json!({ "uploads": { "waiting": 1, "day_bytes": 10 } });
    assert_eq!(
        site.change_first_stage(quotas).await.json(200)["uploads"],
        json!({ "waiting": 1, "day_bytes": 10 })
    );
    let upload = async || site.upload(&team.token, GZIP.to_vec()).await;
    upload().await.json(201);
    upload()
        .await
        .problem(429, "too-many-pending", &["1 submissions"]);
    // Without `waiting`, the server's limit of pending submissions applies. Two bundles of 4 bytes leave too few for a third.
    site.change_first_stage(json!({ "uploads": { "day_bytes": 10 } }))
        .await
        .json(200);
    upload().await.json(201);
    let problem = upload()
        .await
        .problem(429, "day-quota-spent", &["at most 10 bytes"]);
    assert_eq!(
        (&problem["limit_bytes"], &problem["used_bytes"]),
        (&json!(10), &json!(2 * GZIP.len()))
    );
    site.change_first_stage(json!({ "uploads": { "stored_bytes": 9 } }))
        .await
        .json(200);
    upload()
        .await
        .problem(409, "stored-quota-spent", &["at most 9 bytes"]);
    site.change_first_stage(json!({ "uploads": {} }))
        .await
        .json(200);
    upload().await.json(201);
}

#[tokio::test]
async fn invalid_limits_and_quotas_are_refused_by_name() {
    let site = Site::start().await;
    for (body, words) in [
        (
            json!({ "limits": { "memory_bytes": 10 } }),
            &["limits.memory_bytes", "at least 16777216", "got 10"][..],
        ),
        (
            json!({ "limits": { "pids": 1 } }),
            &["limits.pids", "at least 2"],
        ),
        (
            json!({ "limits": { "cpus": 0 } }),
            &["limits.cpus", "0.01 to 1024"],
        ),
        (json!({ "limits": { "step_s": -1 } }), &["limits.step_s"]),
        (json!({ "limits": { "memory": 1 } }), &["memory"]),
        (json!({ "limits": { "pids": "many" } }), &["pids"]),
        (
            json!({ "uploads": { "waiting": 0 } }),
            &["uploads.waiting", "at least 1"],
        ),
        (
            json!({ "uploads": { "day_bytes": 0 } }),
            &["uploads.day_bytes"],
        ),
        (json!({ "uploads": { "per_week": 1 } }), &["per_week"]),
    ] {
        let mut body = body;
        body["confirm"] = json!("Qualifying");
        site.change_first_stage(body)
            .await
            .problem(422, "invalid-content", words);
    }
}
