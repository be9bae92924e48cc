//! Frozen boards, missed days and extra turns, over HTTP.

use crate::site::{ADMIN, Site, result, text};
use serde_json::{Value, json};

const WHY: &str = "the last week is a surprise";

#[tokio::test]
async fn a_frozen_board_says_so_and_hides_what_comes_later_from_everybody_but_the_organiser() {
    let site = Site::start().await;
    site.ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
        .await;
    let before = site.get("/api/v1/board", None).await.json(200);
    let stage = site.stage().await;
    let act = |what: &str| format!("/api/v1/stages/{stage}/{what}");
    let team = site.team("Beta").await;
    site.valid_submission(&team, "b").await;

    for token in [None, Some(team.token.as_str())] {
        for what in ["freeze", "unfreeze"] {
            let answer = site
                .post(&act(what), token, &json!({ "reason": WHY }))
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
        site.post(&act("freeze"), Some(ADMIN), &wrong)
            .await
            .problem(422, "invalid-content", &["reason"]);
    }
    site.post(&act("unfreeze"), Some(ADMIN), &json!({}))
        .await
        .problem(409, "conflict", &["not frozen"]);
    let nowhere = "/api/v1/stages/00000000-0000-0000-0000-000000000000/freeze";
    site.post(nowhere, Some(ADMIN), &json!({ "reason": WHY }))
        .await
        .problem(404, "not-found", &["stage"]);

    let frozen = site
        .post(&act("freeze"), Some(ADMIN), &json!({ "reason": WHY }))
        .await
        .json(200);
    assert_eq!(
        frozen["frozen"],
        json!({ "at": "2026-03-01T10:00:00Z", "reason": WHY })
    );
    site.post(&act("freeze"), Some(ADMIN), &json!({ "reason": WHY }))
        .await
        .problem(409, "conflict", &["frozen already"]);
    site.next_day();
    let started = site
        .post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
    site.finish(&result([0.9, 0.9, 0.9], 20.0)).await;
    site.finish(&result([0.8, 0.8, 0.8], 30.0)).await;

    let shown = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(shown["frozen"]["reason"], WHY);
    assert_eq!(shown["rows"].as_array().unwrap().len(), 1);
    assert_eq!(
        shown["rows"][0]["evaluation"],
        before["rows"][0]["evaluation"]
    );
    let of_task = site.get("/api/v1/board/hit", None).await.json(200);
    assert_eq!(of_task["rows"].as_array().unwrap().len(), 1);
    let live = site
        .get("/api/v1/board?live=true", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(live["rows"].as_array().unwrap().len(), 2);
    assert_eq!(live["frozen"]["reason"], WHY, "the organiser is told, too");
    let page = site.get("/", None).await.body;
    assert!(page.contains("Frozen") && page.contains(WHY), "{page}");
    let ids: Vec<String> = started["created"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| text(&one["id"]))
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
        .problem(409, "not-yet", &["frozen", WHY]);
    // Its team sees its own.
    let beta = site
        .get("/api/v1/evaluations", Some(&team.token))
        .await
        .json(200);
    assert_eq!(beta[0]["state"], "finished");

    let unfrozen = site
        .post(&act("unfreeze"), Some(ADMIN), &json!({}))
        .await
        .json(200);
    assert_eq!(unfrozen["frozen"], Value::Null);
    let shown = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (shown["rows"].as_array().unwrap().len(), &shown["frozen"]),
        (2, &Value::Null)
    );
    let page = site
        .get(&format!("/evaluations/{}", ids[0]), None)
        .await
        .body;
    assert!(page.contains("90.0"), "{page}");
}

#[tokio::test]
async fn a_missed_day_is_made_up_for_and_everybody_reads_why() {
    let site = Site::start().await;
    site.ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
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
            "day-has-cut",
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
        .problem(409, "conflict", &["not of the stage", "2026-03-01"]);

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
            &season["days"][0]["cut_at"]
        ),
        (
            &json!("2026-03-02"),
            &json!("power failure"),
            &json!("2026-03-03T10:00:00Z")
        )
    );
    site.finish(&result([0.9, 0.9, 0.9], 20.0)).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["day"], "2026-03-02");
    // The day of today starts as ever.
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .json(200);
}

#[tokio::test]
async fn an_extra_turn_is_confirmed_where_it_replaces_and_shown_as_one() {
    let site = Site::start().await;
    site.ranked_teams(&[("Alpha", result([0.5, 0.5, 0.5], 10.0))])
        .await;
    let stage = site.stage().await;
    let path = format!("/api/v1/stages/{stage}/days/2026-03-01/extra-turn");
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    let alpha = teams[0]["id"].clone();
    let beta = site.team("Beta").await;
    let wanted = |team: &Value| json!({ "team": team, "reason": "joined late" });
    let of_beta = wanted(&json!(beta.id));

    site.post(&path, None, &of_beta)
        .await
        .problem(401, "unauthenticated", &[]);
    site.post(&path, Some(&beta.token), &of_beta)
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
    let nobody = wanted(&json!("00000000-0000-0000-0000-000000000000"));
    site.post(&path, Some(ADMIN), &nobody)
        .await
        .problem(404, "not-found", &["team"]);
    for day in ["2026-03-02", "someday"] {
        let path = path.replace("2026-03-01", day);
        site.post(&path, Some(ADMIN), &wanted(&alpha))
            .await
            .problem(404, "not-found", &["day"]);
    }
    site.post(&path, Some(ADMIN), &of_beta).await.problem(
        409,
        "conflict",
        &["no submission active"],
    );

    // Beta had none: no confirmation, and the seed of the released day is not used again.
    site.valid_submission(&beta, "b").await;
    let turn = site.post(&path, Some(ADMIN), &of_beta).await;
    assert_eq!(turn.status, 201, "{}", turn.body);
    let turn = turn.json(201);
    assert_eq!(
        (&turn["day"], &turn["extra_turn"]),
        (&json!("2026-03-01"), &json!("joined late"))
    );
    site.post(&path, Some(ADMIN), &of_beta)
        .await
        .problem(409, "conflict", &["under way"]);
    site.finish_as(|task, episode| crate::site::outcome(task, episode, false))
        .await;
    let board = site.get("/api/v1/board", None).await.json(200);
    let rows = board["rows"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|row| row["team"] == name).unwrap();
    assert_eq!(row("Beta")["extra_turn"], "joined late");
    assert_eq!(row("Alpha")["extra_turn"], Value::Null);
    assert_ne!(row("Beta")["seed"], row("Alpha")["seed"]);
    let page = site.get("/", None).await.body;
    assert!(page.contains("extra turn: joined late"), "{page}");
    let [a, b] = ["Alpha", "Beta"].map(|name| text(&row(name)["evaluation"]));
    let compared = site
        .get(&format!("/api/v1/evaluations/{a}/compare/{b}"), None)
        .await;
    let problem = compared.problem(409, "not-paired", &["same episodes"]);
    assert_eq!(problem["field"], "seed", "{problem}");
    let page = site.get(&format!("/evaluations/{b}"), None).await.body;
    assert!(page.contains("Extra turn"), "{page}");
    assert!(
        !page.contains(&format!("/evaluations/{b}/compare/{a}")),
        "{page}"
    );

    // Alpha had one that counts.
    let unconfirmed = site.post(&path, Some(ADMIN), &wanted(&alpha)).await;
    let problem = unconfirmed.problem(
        409,
        "not-confirmed",
        &["Alpha", "voided at once", "joined late"],
    );
    assert_eq!(problem["confirm"], "Alpha");
    let mut confirmed = wanted(&alpha);
    confirmed["confirm"] = json!("alpha");
    site.post(&path, Some(ADMIN), &confirmed)
        .await
        .problem(409, "not-confirmed", &[]);
    assert_eq!(
        site.get("/api/v1/board", None).await.json(200),
        board,
        "nothing is done"
    );
    confirmed["confirm"] = json!("Alpha");
    site.post(&path, Some(ADMIN), &confirmed).await.json(201);
    let replaced = site
        .get(&format!("/api/v1/evaluations/{a}"), Some(ADMIN))
        .await
        .json(200);
    assert_eq!(
        replaced["voided"]["reason"],
        "replaced by an extra turn: joined late"
    );

    let disqualify = format!("/api/v1/teams/{}/disqualify", beta.id);
    let ruling = json!({ "reason": "cheating", "confirm": "Beta" });
    site.post(&disqualify, Some(ADMIN), &ruling).await.json(200);
    let mut again = of_beta.clone();
    again["confirm"] = json!("Beta");
    site.post(&path, Some(ADMIN), &again)
        .await
        .problem(403, "disqualified", &[]);
}
