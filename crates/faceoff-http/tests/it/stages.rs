//! Tests of stages (periods of the season with rules and boards of their own) in the API and on pages.

use crate::site::{ADMIN, Answer, Site, result};
use faceoff_testkit::change_rules;
use serde_json::{Value, json};

async fn create_stage(site: &Site, body: Value) -> Answer {
    site.post("/api/v1/stages", Some(ADMIN), &body).await
}

async fn change_stage(site: &Site, stage: &Value, body: Value) -> Answer {
    site.change_stage(stage["id"].as_str().unwrap(), body).await
}

#[tokio::test]
async fn stage_is_created_changed_and_evaluated() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let created = create_stage(
        &site,
        json!({
            "name": "Final",
            "opens_at": "2026-03-02T08:00:00Z",
            "closes_at": "2026-03-09T08:00:00Z",
            "zone": "Europe/Berlin",
            "episodes_per_task": 2,
            "schedule": { "cron": "0 9 * * 1-5", "days_off": ["2026-03-04"] },
        }),
    )
    .await
    .json(201);
    assert_eq!(created["phase"], "upcoming");
    assert_eq!(created["profile"], "evaluation", "as in the open stage");
    assert_eq!(
        (
            &created["revision"],
            &created["since"],
            &created["episodes_per_task"]
        ),
        (&json!(1), &json!("2026-03-02T08:00:00Z"), &json!(2))
    );
    // The stage opens on Monday at 9:00 in Berlin.
    assert_eq!(created["next_cutoff"]["day"], "2026-03-02");
    assert_eq!(created["next_cutoff"]["at"], "2026-03-02T08:00:00Z");
    let path = format!("/api/v1/stages/{}", created["id"].as_str().unwrap());
    assert_eq!(site.get(&path, Some(ADMIN)).await.json(200), created);
    let stages = site.get("/api/v1/stages", Some(ADMIN)).await.json(200);
    assert_eq!(stages.as_array().unwrap().len(), 2);
    assert_eq!(stages[1], created);
    assert_eq!(
        site.get("/api/v1/season", Some(ADMIN)).await.json(200)["stages"],
        stages
    );

    let start_request = json!({ "stage": created["id"] });
    site.post("/api/v1/days", Some(ADMIN), &start_request)
        .await
        .problem(409, "stage-not-open", &["Final", "2026-03-02 08:00:00 UTC"]);
    let changed = change_stage(
        &site,
        &created,
        json!({ "schedule": null, "closes_at": null, "name": "Finals" }),
    )
    .await;
    let changed = changed.json(200);
    assert_eq!(
        (
            &changed["schedule"],
            &changed["closes_at"],
            &changed["name"]
        ),
        (&json!(null), &json!(null), &json!("Finals"))
    );

    site.next_day();
    // Two stages are open, so the request must name one.
    site.post("/api/v1/days", Some(ADMIN), &json!({}))
        .await
        .problem(422, "invalid-content", &["stage", "Qualifying", "Finals"]);
    let day = site
        .post("/api/v1/days", Some(ADMIN), &start_request)
        .await
        .json(200);
    assert_eq!(
        (&day["stage"], &day["day"]),
        (&created["id"], &json!("2026-03-02"))
    );
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (
            &board["stage_name"],
            board["rows"].as_array().unwrap().len()
        ),
        (&json!("Finals"), 1)
    );
    let board_of_first_stage = format!("/api/v1/board?stage={}", site.stage().await);
    let board_of_first_stage = site.get(&board_of_first_stage, None).await.json(200);
    assert_eq!(board_of_first_stage["rows"], json!([]));
}

#[tokio::test]
async fn changed_rules_need_confirmation_and_have_their_own_board() {
    let site = Site::start().await;
    site.team_with_evaluation("Alpha", "a").await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let stage = site.get("/api/v1/stages", None).await.json(200)[0].clone();
    let new_rules = json!({ "episodes_per_task": 9 });
    let unconfirmed = change_stage(&site, &stage, new_rules).await;
    let problem = unconfirmed.problem(
        409,
        "not-confirmed",
        &["revision 2", "empty board", "confirm"],
    );
    assert_eq!(problem["confirm"], "Qualifying");
    let unchanged = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(unchanged[0], stage, "nothing was done");

    let new_rules = json!({ "episodes_per_task": 9, "confirm": "Qualifying" });
    let changed = change_stage(&site, &stage, new_rules).await.json(200);
    assert_eq!(changed["revision"], 2);
    assert_eq!(changed["configured"], false);
    let revisions: Vec<_> = changed["revisions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|rules| {
            (
                rules["revision"].clone(),
                rules["episodes_per_task"].clone(),
            )
        })
        .collect();
    assert_eq!(revisions, [(json!(1), json!(4)), (json!(2), json!(9))]);

    // Until the first result by the new rules, the board of the old revision is shown and named.
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (&board["revision"], board["rows"].as_array().unwrap().len()),
        (&json!(1), 1)
    );
    let page = site.get("/", None).await.body;
    assert!(
        page.contains("Rules: revision 1, since 2026-03-01 10:00 UTC"),
        "{page}"
    );
    assert!(
        page.contains("revision=2"),
        "a link to the other board: {page}"
    );
    let new_board = format!("/?stage={}&revision=2", stage["id"].as_str().unwrap());
    let new_board = site.get(&new_board, None).await;
    assert_eq!(new_board.status, 200);
    assert!(
        new_board.body.contains("No team has a result yet"),
        "{}",
        new_board.body
    );
}

#[tokio::test]
async fn stage_keeps_its_ruleset_until_its_rules_change() {
    let site = Site::start().await;
    // Stores the stage as a server of an earlier version would have, whose newest ruleset was the previous one.
    change_rules(&site.store, site.stage().await, site.now(), |rules| {
        rules.ruleset = faceoff_airhockey::RULESETS[1];
    })
    .await
    .unwrap();
    let stage = site.get("/api/v1/stages", None).await.json(200)[0].clone();
    for (body, revision, ruleset) in [
        (json!({ "name": "Heats" }), 2, "airhockey-2023.2"),
        (
            json!({ "episodes_per_task": 9, "confirm": "Heats" }),
            3,
            "airhockey-2023.3",
        ),
    ] {
        let changed = change_stage(&site, &stage, body).await.json(200);
        assert_eq!(
            (&changed["revision"], &changed["ruleset"]),
            (&json!(revision), &json!(ruleset))
        );
    }
}

#[tokio::test]
async fn started_stage_refuses_most_changes() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "a").await;
    let create_until_tuesday = async |name: &str, opens_at: &str| {
        let stage = json!({
            "name": name,
            "opens_at": opens_at,
            "closes_at": "2026-03-03T10:00:00Z",
        });
        create_stage(&site, stage).await.json(201)
    };
    let open = create_until_tuesday("Warm-up", "2026-03-01T10:00:00Z").await;
    let upcoming = create_until_tuesday("Final", "2026-03-02T10:00:00Z").await;
    for (stage, change, words) in [
        (
            &open,
            json!({ "opens_at": "2026-03-02T00:00:00Z" }),
            ["opens_at", "opened at 2026-03-01T10:00:00Z"],
        ),
        (
            &upcoming,
            json!({ "opens_at": "2026-03-01T09:00:00Z" }),
            ["opens_at", "future"],
        ),
        (
            &upcoming,
            json!({ "opens_at": "2026-03-04T10:00:00Z" }),
            ["closes_at", "after the opening"],
        ),
        (
            &open,
            json!({ "closes_at": "2026-03-01T10:00:00Z" }),
            ["closes_at", "after the opening"],
        ),
    ] {
        change_stage(&site, stage, change)
            .await
            .problem(409, "conflict", &words);
    }
    change_stage(&site, &upcoming, json!({ "name": "warm-UP" }))
        .await
        .problem(409, "stage-name-taken", &["warm-UP"]);
    change_stage(&site, &open, json!({ "zone": "Europe/Berlin" }))
        .await
        .json(200);

    // Before the opening, new rules replace the old ones without a new revision.
    let new_rules_and_opening =
        json!({ "episodes_per_task": 9, "opens_at": "2026-03-02T12:00:00Z" });
    let changed = change_stage(&site, &upcoming, new_rules_and_opening)
        .await
        .json(200);
    assert_eq!(
        [
            &changed["revision"],
            &changed["since"],
            &changed["episodes_per_task"]
        ],
        [&json!(1), &json!("2026-03-02T12:00:00Z"), &json!(9)]
    );

    // Once a day has started, the zone is fixed, since days are dates in that zone. Once closed, the stage is fixed.
    site.post("/api/v1/days", Some(ADMIN), &json!({ "stage": open["id"] }))
        .await
        .json(200);
    change_stage(&site, &open, json!({ "zone": "UTC" }))
        .await
        .problem(409, "conflict", &["zone", "Europe/Berlin"]);
    site.set_time("2026-03-03T10:00:00Z".parse().unwrap());
    change_stage(&site, &open, json!({ "name": "Done" }))
        .await
        .problem(409, "conflict", &["closed at", "another stage"]);
    change_stage(&site, &open, json!({ "closes_at": "2026-03-09T10:00:00Z" }))
        .await
        .problem(409, "conflict", &["closed at"]);
}

#[tokio::test]
async fn pages_show_stages() {
    let site = Site::start_with_schedule("12:00").await;
    let created = create_stage(
        &site,
        json!({ "name": "Final", "opens_at": "2026-03-02T08:00:00Z", "closes_at": "2026-03-09T08:00:00Z" }),
    );
    created.await.json(201);
    let page = site.get("/", None).await.body;
    for part in [
        "stage <strong>Qualifying</strong>, open",
        "1 March, 12:00 UTC",
        ">Final</a>",
    ] {
        assert!(page.contains(part), "{part:?} is not in {page}");
    }
    let season = site.get("/season", None).await.body;
    for part in [
        "Final",
        "2026-03-09 08:00:00 UTC",
        "no date set",
        "revision 1 since",
    ] {
        assert!(season.contains(part), "{part:?} is not in {season}");
    }
    for path in ["/?stage=chess", "/?revision=x", "/tasks/hit?stage=1"] {
        let page = site.get(path, None).await;
        assert_eq!(page.status, 400, "{path}: {}", page.body);
    }
    assert_eq!(site.get("/?revision=7", None).await.status, 404);
    assert_eq!(site.get("/tasks/hit?revision=1", None).await.status, 200);
}

#[tokio::test]
async fn invalid_stage_is_refused_with_valid_values() {
    let site = Site::start().await;
    let log_before = site.get("/api/v1/events", Some(ADMIN)).await.json(200);
    for (body, status, slug, words) in [
        (json!({}), 422, "invalid-content", &["name"][..]),
        (json!({ "name": "" }), 422, "invalid-content", &["1 to 40"]),
        (
            json!({ "name": "qualifying" }),
            409,
            "stage-name-taken",
            &["qualifying"],
        ),
        (
            json!({ "name": "F", "zone": "Berlin" }),
            422,
            "invalid-content",
            &["zone", "Europe/Berlin"],
        ),
        (
            json!({ "name": "F", "tasks": [] }),
            422,
            "invalid-content",
            &["tasks", "at least one"],
        ),
        (
            json!({ "name": "F", "tasks": ["hit", "hit"] }),
            422,
            "invalid-content",
            &["tasks"],
        ),
        (
            json!({ "name": "F", "tasks": ["chess"] }),
            422,
            "invalid-content",
            &["tasks", "chess"],
        ),
        (
            json!({ "name": "F", "episodes_per_task": 0 }),
            422,
            "invalid-content",
            &["episodes_per_task", "got 0"],
        ),
        (
            json!({ "name": "F", "episodes_per_shard": 0 }),
            422,
            "invalid-content",
            &["episodes_per_shard"],
        ),
        (
            json!({ "name": "F", "profile": "easy" }),
            422,
            "invalid-content",
            &["profile", "easy"],
        ),
        (
            json!({ "name": "F", "schedule": { "daily": "06:00", "cron": "* * * * *" } }),
            422,
            "invalid-content",
            &["schedule", "either"],
        ),
        (
            json!({ "name": "F", "schedule": { "cron": "61 * * * *" } }),
            422,
            "invalid-content",
            &["schedule", "five fields"],
        ),
        (
            json!({ "name": "F", "opens_at": "soon" }),
            422,
            "invalid-content",
            &["opens_at"],
        ),
        (
            json!({ "name": "F", "closes_at": "2026-03-01T09:00:00Z" }),
            409,
            "conflict",
            &["closes_at"],
        ),
        (
            json!({ "name": "F", "deadline": "2026-03-01T09:00:00Z" }),
            422,
            "invalid-content",
            &["deadline", "closes_at"],
        ),
    ] {
        create_stage(&site, body).await.problem(status, slug, words);
    }
    let stages = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(stages.as_array().unwrap().len(), 1);
    let log = site.get("/api/v1/events", Some(ADMIN)).await.json(200);
    assert_eq!(log, log_before, "a refusal is no event");
    let team = site.team("Alpha").await;
    let by_team = site
        .post("/api/v1/stages", Some(&team.token), &json!({ "name": "F" }))
        .await;
    by_team.problem(403, "forbidden", &[]);
    let by_visitor = site
        .post("/api/v1/stages", None, &json!({ "name": "F" }))
        .await;
    by_visitor.problem(401, "unauthenticated", &[]);
    let missing = json!({ "id": uuid::Uuid::nil() });
    change_stage(&site, &missing, json!({ "name": "F" }))
        .await
        .problem(404, "not-found", &["stage"]);
    let stage = site.get("/api/v1/stages", None).await.json(200)[0].clone();
    change_stage(&site, &stage, json!({ "opens_at": "2026-03-05T09:00:00Z" }))
        .await
        .problem(409, "conflict", &["opens_at", "opened"]);
}
