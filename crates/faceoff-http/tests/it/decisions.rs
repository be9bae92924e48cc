//! Tests of an organiser's decisions in the API: frozen boards, which show no later results; missed evaluation days, which are
//! started later; and extra evaluations of one team.

use crate::site::{ADMIN, Site, result, string};
use serde_json::{Value, json};

const REASON: &str = "the last week is a surprise";

#[tokio::test]
async fn frozen_board_hides_later_results_from_the_public() {
    let site = Site::start().await;
    site.add_ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
        .await;
    let board_before_freeze = site.get("/api/v1/board", None).await.json(200);
    let stage = site.stage().await;
    let decision_path = |decision: &str| format!("/api/v1/stages/{stage}/{decision}");
    let team = site.team("Beta").await;
    site.valid_submission(&team, "b").await;

    for token in [None, Some(team.token.as_str())] {
        for decision in ["freeze", "unfreeze"] {
            let answer = site
                .post(
                    &decision_path(decision),
                    token,
                    &json!({ "reason": REASON }),
                )
                .await;
            let expected = if token.is_none() {
                (401, "unauthenticated")
            } else {
                (403, "forbidden")
            };
            answer.problem(expected.0, expected.1, &[]);
        }
        let live = site.get("/api/v1/board?live=true", token).await;
        let expected = if token.is_none() {
            (401, "unauthenticated")
        } else {
            (403, "forbidden")
        };
        live.problem(expected.0, expected.1, &[]);
    }
    for wrong in [
        json!({}),
        json!({ "reason": "" }),
        json!({ "reason": "x".repeat(501) }),
        json!({ "reason": 1 }),
    ] {
        site.post(&decision_path("freeze"), Some(ADMIN), &wrong)
            .await
            .problem(422, "invalid-content", &["reason"]);
    }
    site.post(&decision_path("unfreeze"), Some(ADMIN), &json!({}))
        .await
        .problem(409, "conflict", &["not frozen"]);
    let unknown_stage = "/api/v1/stages/00000000-0000-0000-0000-000000000000/freeze";
    site.post(unknown_stage, Some(ADMIN), &json!({ "reason": REASON }))
        .await
        .problem(404, "not-found", &["stage"]);

    let frozen = site
        .post(
            &decision_path("freeze"),
            Some(ADMIN),
            &json!({ "reason": REASON }),
        )
        .await
        .json(200);
    assert_eq!(
        frozen["frozen"],
        json!({ "at": "2026-03-01T10:00:00Z", "reason": REASON })
    );
    site.post(
        &decision_path("freeze"),
        Some(ADMIN),
        &json!({ "reason": REASON }),
    )
    .await
    .problem(409, "conflict", &["frozen already"]);
    site.next_day();
    let started = site.start_day().await;
    site.finish_evaluation(&result([0.9, 0.9, 0.9], 20.0)).await;
    site.finish_evaluation(&result([0.8, 0.8, 0.8], 30.0)).await;

    let frozen_board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(frozen_board["frozen"]["reason"], REASON);
    assert_eq!(frozen_board["rows"].as_array().unwrap().len(), 1);
    assert_eq!(
        frozen_board["rows"][0]["evaluation"],
        board_before_freeze["rows"][0]["evaluation"]
    );
    let task_board = site.get("/api/v1/board/hit", None).await.json(200);
    assert_eq!(task_board["rows"].as_array().unwrap().len(), 1);
    let live = site
        .get("/api/v1/board?live=true", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(live["rows"].as_array().unwrap().len(), 2);
    assert_eq!(
        live["frozen"]["reason"], REASON,
        "the live board shows the freeze, too"
    );
    let page = site.get("/", None).await.body;
    assert!(page.contains("Frozen") && page.contains(REASON), "{page}");
    let ids: Vec<String> = started["created"]
        .as_array()
        .unwrap()
        .iter()
        .map(|evaluation| string(&evaluation["id"]))
        .collect();
    let page = site
        .get(&format!("/evaluations/{}", ids[0]), None)
        .await
        .body;
    assert!(
        page.contains("are frozen since") && !page.contains("90.0"),
        "{page}"
    );
    let compare = format!("/api/v1/evaluations/{}/compare/{}", ids[0], ids[1]);
    site.get(&compare, None)
        .await
        .problem(409, "not-yet", &["frozen", REASON]);
    // The team sees its own evaluation.
    let beta = site
        .get("/api/v1/evaluations", Some(&team.token))
        .await
        .json(200);
    assert_eq!(beta[0]["state"], "finished");

    let unfrozen = site
        .post(&decision_path("unfreeze"), Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(unfrozen["frozen"], Value::Null);
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (board["rows"].as_array().unwrap().len(), &board["frozen"]),
        (2, &Value::Null)
    );
    let page = site
        .get(&format!("/evaluations/{}", ids[0]), None)
        .await
        .body;
    assert!(page.contains("90.0"), "{page}");
}

#[tokio::test]
async fn missed_day_is_evaluated_later_with_a_public_reason() {
    let site = Site::start().await;
    site.add_ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
        .await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/days");
    let team = site.team("Beta").await;
    site.next_day();
    site.next_day();
    let missed = |day: &str| json!({ "day": day, "reason": "power failure" });
    site.post(&path, None, &missed("2026-03-02"))
        .await
        .problem(401, "unauthenticated", &[]);
    site.post(&path, Some(&team.token), &missed("2026-03-02"))
        .await
        .problem(403, "forbidden", &[]);
    for (wrong, words) in [
        (json!({ "day": "2026-03-02" }), "reason"),
        (json!({ "reason": "power failure" }), "day"),
        (
            json!({ "day": "yesterday", "reason": "power failure" }),
            "day",
        ),
        (
            json!({ "day": "2026-02-30", "reason": "power failure" }),
            "day",
        ),
        (json!({ "day": "2026-03-02", "reason": " " }), "reason"),
        (
            json!({ "day": "2026-03-02", "reason": "power failure", "seed": 1 }),
            "seed",
        ),
    ] {
        site.post(&path, Some(ADMIN), &wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    site.post(&path, Some(ADMIN), &missed("2026-03-01"))
        .await
        .problem(
            409,
            "cutoff-passed",
            &[
                "2026-03-01",
                "2026-03-01 10:00:00 UTC",
                "nothing was started",
            ],
        );
    for future in ["2026-03-03", "2026-03-04"] {
        site.post(&path, Some(ADMIN), &missed(future))
            .await
            .problem(409, "conflict", &["has not passed", "2026-03-03"]);
    }
    site.post(&path, Some(ADMIN), &missed("2026-02-28"))
        .await
        .problem(
            409,
            "conflict",
            &["before the stage's first day", "2026-03-01"],
        );

    let day = site
        .post(&path, Some(ADMIN), &missed("2026-03-02"))
        .await
        .json(200);
    assert_eq!(
        (&day["day"], day["created"].as_array().unwrap().len()),
        (&json!("2026-03-02"), 1)
    );
    assert_eq!(day["without_submission"][0]["name"], "Beta");
    let season = site.get("/api/v1/season", None).await.json(200);
    assert_eq!(
        (
            &season["days"][0]["day"],
            &season["days"][0]["missed"],
            &season["days"][0]["cutoff_at"]
        ),
        (
            &json!("2026-03-02"),
            &json!("power failure"),
            &json!("2026-03-03T10:00:00Z")
        )
    );
    site.finish_evaluation(&result([0.9, 0.9, 0.9], 20.0)).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["day"], "2026-03-02");
    // Today's day can still be started.
    site.start_day().await;
}

#[tokio::test]
async fn extra_evaluation_is_confirmed_when_it_replaces_one() {
    let site = Site::start().await;
    site.add_ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
        .await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/days/2026-03-01/extra-evaluation");
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    let alpha = teams[0]["id"].clone();
    let beta = site.team("Beta").await;
    let request = |team: &Value| json!({ "team": team, "reason": "joined late" });
    let beta_request = request(&json!(beta.id));

    site.post(&path, None, &beta_request)
        .await
        .problem(401, "unauthenticated", &[]);
    site.post(&path, Some(&beta.token), &beta_request)
        .await
        .problem(403, "forbidden", &[]);
    for (wrong, words) in [
        (json!({ "team": beta.id }), "reason"),
        (json!({ "reason": "joined late" }), "team"),
        (json!({ "team": "Beta", "reason": "joined late" }), "team"),
        (json!({ "team": beta.id, "reason": "" }), "reason"),
    ] {
        site.post(&path, Some(ADMIN), &wrong)
            .await
            .problem(422, "invalid-content", &[words]);
    }
    let unknown_team = request(&json!("00000000-0000-0000-0000-000000000000"));
    site.post(&path, Some(ADMIN), &unknown_team)
        .await
        .problem(404, "not-found", &["team"]);
    for day in ["2026-03-02", "someday"] {
        let path = path.replace("2026-03-01", day);
        site.post(&path, Some(ADMIN), &request(&alpha))
            .await
            .problem(404, "not-found", &["day"]);
    }
    site.post(&path, Some(ADMIN), &beta_request).await.problem(
        409,
        "conflict",
        &["no active submission"],
    );

    // Beta has no evaluation of that day, so no confirmation is needed. The episodes have a new seed, since the day is
    // released.
    site.valid_submission(&beta, "b").await;
    let created = site.post(&path, Some(ADMIN), &beta_request).await;
    assert_eq!(created.status, 201, "{}", created.body);
    let created = created.json(201);
    assert_eq!(
        (&created["day"], &created["extra_evaluation"]),
        (&json!("2026-03-01"), &json!("joined late"))
    );
    site.post(&path, Some(ADMIN), &beta_request).await.problem(
        409,
        "conflict",
        &["queued or running"],
    );
    site.run_evaluation(|task, episode| crate::site::outcome(task, episode, false))
        .await;
    let board = site.get("/api/v1/board", None).await.json(200);
    let rows = board["rows"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|row| row["team"] == name).unwrap();
    assert_eq!(row("Beta")["extra_evaluation"], "joined late");
    assert_eq!(row("Alpha")["extra_evaluation"], Value::Null);
    assert_ne!(row("Beta")["seed"], row("Alpha")["seed"]);
    let page = site.get("/", None).await.body;
    assert!(page.contains("extra evaluation: joined late"), "{page}");
    let [alpha_evaluation, beta_evaluation] =
        ["Alpha", "Beta"].map(|name| string(&row(name)["evaluation"]));
    let compared = site
        .get(
            &format!("/api/v1/evaluations/{alpha_evaluation}/compare/{beta_evaluation}"),
            None,
        )
        .await;
    let problem = compared.problem(409, "not-paired", &["same episodes"]);
    assert_eq!(problem["field"], "seed", "{problem}");
    let page = site
        .get(&format!("/evaluations/{beta_evaluation}"), None)
        .await
        .body;
    assert!(page.contains("Extra evaluation"), "{page}");
    assert!(
        !page.contains(&format!(
            "/evaluations/{beta_evaluation}/compare/{alpha_evaluation}"
        )),
        "{page}"
    );

    // Alpha has an evaluation that counts, so a confirmation is needed.
    let unconfirmed = site.post(&path, Some(ADMIN), &request(&alpha)).await;
    let problem = unconfirmed.problem(
        409,
        "not-confirmed",
        &["Alpha", "voided at once", "joined late"],
    );
    assert_eq!(problem["confirm"], "Alpha");
    let mut confirmed = request(&alpha);
    confirmed["confirm"] = json!("alpha");
    site.post(&path, Some(ADMIN), &confirmed)
        .await
        .problem(409, "not-confirmed", &[]);
    assert_eq!(
        site.get("/api/v1/board", None).await.json(200),
        board,
        "nothing has changed"
    );
    confirmed["confirm"] = json!("Alpha");
    site.post(&path, Some(ADMIN), &confirmed).await.json(201);
    let replaced = site
        .get(
            &format!("/api/v1/evaluations/{alpha_evaluation}"),
            Some(ADMIN),
        )
        .await
        .json(200);
    assert_eq!(
        replaced["voided"]["reason"],
        "replaced by an extra evaluation: joined late"
    );

    let disqualify = format!("/api/v1/teams/{}/disqualify", beta.id);
    let decision = json!({ "reason": "cheating", "confirm": "Beta" });
    site.post(&disqualify, Some(ADMIN), &decision)
        .await
        .json(200);
    let mut confirmed_request = beta_request.clone();
    confirmed_request["confirm"] = json!("Beta");
    site.post(&path, Some(ADMIN), &confirmed_request)
        .await
        .problem(403, "disqualified", &[]);
}
