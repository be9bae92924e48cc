//! Tests of blind stages, whose results only organisers see until they reveal them, on every page and in the whole API.

use crate::site::{ADMIN, Answer, Site, TestTeam, result};
use serde_json::json;

/// Starts an evaluation day of a blind stage with two teams. Returns the API paths of their evaluations.
async fn blind_day(site: &Site) -> ([TestTeam; 2], [String; 2]) {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    let mut submissions = Vec::new();
    for team in &teams {
        submissions.push(site.valid_submission(team, "agent").await);
    }
    let blind = site
        .change_first_stage(json!({ "blind": true }))
        .await
        .json(200);
    assert_eq!(blind["blind"], true);
    let paths = [
        site.start_evaluation(&teams[0], &submissions[0]).await,
        site.start_evaluation(&teams[1], &submissions[1]).await,
    ];
    (teams, paths)
}

/// Texts that reveal a score: names of fields, and numbers of the results that the tests commit.
const REVEALING: [&str; 12] = [
    "success_rate",
    "successes",
    "\"tier\"",
    "\"score\"",
    "penalty_points\"",
    "blake3\":\"",
    "51.1",
    "0.511",
    "59.98",
    "60.0 ",
    "777.5",
    "significant\"",
];

#[track_caller]
fn check_reveals_nothing(answer: &Answer) {
    for text in REVEALING {
        assert!(!answer.body.contains(text), "{text} is in {}", answer.body);
    }
}

#[tokio::test]
async fn blind_results_are_visible_to_organisers_only() {
    let site = Site::start().await;
    let ([alpha, beta], [alpha_evaluation, beta_evaluation]) = blind_day(&site).await;
    site.finish_evaluation(&result([0.511, 0.622, 0.733], 777.5))
        .await;
    site.finish_evaluation(&result([0.1, 0.2, 0.3], 10.0)).await;
    let ids = [&alpha_evaluation, &beta_evaluation]
        .map(|path| path.rsplit('/').next().unwrap().to_owned());
    let compared = format!("{alpha_evaluation}/compare/{}", ids[1]);
    let pages = [
        "/".to_owned(),
        "/tasks/hit".to_owned(),
        "/season".to_owned(),
        alpha_evaluation.replace("/api/v1", ""),
        format!("/teams/{}", alpha.id),
    ];

    for token in [None, Some(&alpha.token), Some(&beta.token)] {
        let token = token.map(String::as_str);
        for board in [
            "/api/v1/board",
            "/api/v1/board/hit",
            "/api/v1/board?revision=1",
        ] {
            let answer = site.get(board, token).await;
            check_reveals_nothing(&answer);
            let board = answer.json(200);
            assert_eq!(
                (&board["blind"], &board["rows"]),
                (&json!(true), &json!([]))
            );
        }
        let season = site.get("/api/v1/season", token).await;
        check_reveals_nothing(&season);
        let season = season.json(200);
        assert_ne!(season["days"][0]["released_at"], json!(null));
        assert_eq!(
            season["days"][0]["seed"],
            json!(null),
            "scores could be computed from the seed"
        );
        site.get(&compared, token).await.problem(
            409,
            "blind",
            &["Qualifying", "blind", "organisers reveal"],
        );
        for page in &pages {
            let page = site.get(page, token).await;
            page.html(200);
            check_reveals_nothing(&page);
        }
        let page = site.get(&compared.replace("/api/v1", ""), token).await;
        assert_eq!(page.status, 409);
        check_reveals_nothing(&page);
        let board = site.get("/", token).await.body;
        for words in [
            "blind",
            "No date is set",
            "Hidden until the organisers reveal",
        ] {
            assert!(board.contains(words), "{words} is not in {board}");
        }
    }

    let team_view = site.get(&alpha_evaluation, Some(&alpha.token)).await;
    check_reveals_nothing(&team_view);
    let team_view = team_view.json(200);
    assert_eq!(
        (&team_view["state"], &team_view["blind"]),
        (&json!("finished"), &json!(true))
    );
    assert_eq!(
        team_view["progress"]["episodes_done"],
        team_view["progress"]["episodes_total"]
    );
    assert_eq!(
        (team_view.get("result"), team_view.get("dataset")),
        (None, None)
    );
    for list in [
        "/api/v1/evaluations",
        "/api/v1/me",
        "/api/v1/submissions",
        "/api/v1/evaluations?day=2026-03-01",
    ] {
        let answer = site.get(list, Some(&alpha.token)).await;
        assert_eq!(answer.status, 200);
        if list != "/api/v1/submissions" {
            check_reveals_nothing(&answer);
        }
    }
    for file in ["dataset", "violations"] {
        let path = format!("{alpha_evaluation}/{file}");
        site.get(&path, Some(&alpha.token))
            .await
            .problem(409, "blind", &["Qualifying"]);
        site.get(&path, None)
            .await
            .problem(401, "unauthenticated", &[]);
        site.get(&path, Some(&beta.token))
            .await
            .problem(404, "not-found", &[]);
    }
    site.post(
        &format!("{alpha_evaluation}/publish"),
        Some(&alpha.token),
        &json!({}),
    )
    .await
    .problem(409, "blind", &[]);

    // The organiser sees everything; a request with an invalid organiser's token is refused.
    let board = site.get("/api/v1/board", Some(ADMIN)).await.json(200);
    assert_eq!(
        (&board["blind"], board["rows"].as_array().unwrap().len()),
        (&json!(true), 2)
    );
    let organiser_view = site.get(&alpha_evaluation, Some(ADMIN)).await.json(200);
    assert_eq!(
        organiser_view["result"]["tasks"]["hit"]["success_rate"],
        0.511
    );
    assert_eq!(site.get(&compared, Some(ADMIN)).await.status, 200);
    let page = site.get("/", Some(ADMIN)).await.body;
    assert!(
        page.contains("only organisers see this board") && page.contains("51.1"),
        "{page}"
    );
    site.get("/api/v1/board", Some("fo_admin_wrong"))
        .await
        .problem(401, "unauthenticated", &[]);

    // Once revealed, results cannot be hidden again.
    let revealed = site
        .change_first_stage(json!({ "blind": false }))
        .await
        .json(200);
    assert_eq!(revealed["blind"], false);
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(
        (&board["blind"], board["rows"].as_array().unwrap().len()),
        (&json!(false), 2)
    );
    assert_ne!(
        site.get("/api/v1/season", None).await.json(200)["days"][0]["seed"],
        json!(null)
    );
    let team_view = site
        .get(&alpha_evaluation, Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(
        (
            team_view.get("blind"),
            &team_view["result"]["penalty_points"]
        ),
        (None, &json!(777.5))
    );
    let dataset = site
        .get(&format!("{alpha_evaluation}/dataset"), Some(&alpha.token))
        .await;
    assert_eq!(dataset.status, 200);
    site.change_first_stage(json!({ "blind": true }))
        .await
        .problem(
            409,
            "conflict",
            &[
                "blind: 2 evaluations",
                "that was visible",
                "before its first score",
            ],
        );
}

#[tokio::test]
async fn faults_of_a_blind_stage_are_hidden() {
    let site = Site::start().await;
    let ([alpha, _], [alpha_evaluation, _]) = blind_day(&site).await;
    site.run_shards_with_faults(2).await;
    site.finish_evaluation(&result([0.1, 0.2, 0.3], 10.0)).await;
    let team_view = site
        .get(&alpha_evaluation, Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(team_view["state"], "agent_failed");
    assert_ne!(team_view["released_at"], json!(null));
    assert_eq!(
        (team_view.get("faults"), team_view.get("log")),
        (None, None)
    );
    let page = site
        .get(&alpha_evaluation.replace("/api/v1", ""), None)
        .await
        .body;
    assert!(
        page.contains("results are hidden") && !page.contains("protocol"),
        "{page}"
    );
    let board = site.get("/", None).await.body;
    assert!(!board.contains("failed"), "{board}");
    let organiser_view = site.get(&alpha_evaluation, Some(ADMIN)).await.json(200);
    assert_eq!(organiser_view["faults"].as_array().unwrap().len(), 2);
    site.change_first_stage(json!({ "blind": false }))
        .await
        .json(200);
    let team_view = site
        .get(&alpha_evaluation, Some(&alpha.token))
        .await
        .json(200);
    assert_eq!(team_view["faults"].as_array().unwrap().len(), 2);
}

#[tokio::test]
async fn blind_setting_is_validated_and_for_organisers_only() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let new_stage = json!({ "name": "Final", "blind": true, "publishes": "never", "standings": { "mean_of_last": 3 } });
    let created = site
        .post("/api/v1/stages", Some(ADMIN), &new_stage)
        .await
        .json(201);
    assert_eq!(created["blind"], true);
    assert_eq!(
        (&created["publishes"], &created["standings"]),
        (&json!("never"), &json!({ "mean_of_last": 3 }))
    );
    for (field, wrong) in [
        ("blind", json!("yes")),
        ("publishes", json!("tomorrow")),
        ("standings", json!("worst")),
        ("standings", json!({ "mean_of_last": 0 })),
        ("standings", json!({ "mean_of_last": 101 })),
        ("standings", json!({ "mean_of_last": -1 })),
    ] {
        let body = json!({ field: wrong });
        site.change_first_stage(body)
            .await
            .problem(422, "invalid-content", &[field]);
    }
    let path = format!("/api/v1/stages/{}", site.stage().await);
    for (token, status) in [(None, 401), (Some(team.token.as_str()), 403)] {
        let answer = site.patch(&path, token, &json!({ "blind": true })).await;
        assert_eq!(answer.status.as_u16(), status);
    }
}
