//! Tests of invalid input about tournaments and games, and of the documented responses to it.

use super::{cup::TestTournament, fake_worker::GameOutcome};
use crate::site::{ADMIN, Answer, Site};
use reqwest::Method;
use serde_json::json;

const UNKNOWN_ID: &str = "00000000-0000-7000-8000-000000000000";

#[tokio::test]
async fn invalid_tournament_is_refused_with_the_reason() {
    let site = Site::start().await;
    site.team("A").await;
    let create = async |body| site.post("/api/v1/tournaments", Some(ADMIN), &body).await;
    for (body, words) in [
        (json!({}), &["name"][..]),
        (json!({ "name": "" }), &["name"]),
        (
            json!({ "name": "Cup", "teams": ["A", "a"] }),
            &["teams", "twice"],
        ),
        (
            json!({ "name": "Cup", "teams": ["Unknown"] }),
            &["teams", "no team", "Unknown"],
        ),
        (
            json!({ "name": "Cup", "stage": "Final" }),
            &["stage", "Qualifying", "Final"],
        ),
        (
            json!({ "name": "Cup", "rules": { "steps": 0 } }),
            &["rules", "steps", "got 0"],
        ),
        (
            json!({ "name": "Cup", "rules": { "step": 1 } }),
            &["rules", "step"],
        ),
        (
            json!({ "name": "Cup", "rules": { "profile": "easy" } }),
            &["rules", "profile", "easy", "expected ideal"],
        ),
        (
            json!({ "name": "Cup", "rules": { "ruleset": "airhockey-2023.1" } }),
            &["ruleset", "leave it out"],
        ),
        (
            json!({ "name": "Cup", "rules": { "format": { "kind": "knockout" } } }),
            &["rules", "knockout"],
        ),
        (
            json!({ "name": "Cup", "rules": { "format": { "kind": "groups", "groups": 0, "advance": 1 } } }),
            &["format.groups"],
        ),
        (
            json!({ "name": "Cup", "rules": { "format": { "kind": "swiss", "rounds": 101 } } }),
            &["1 to 100"],
        ),
        (
            json!({ "name": "Cup", "rules": { "runtimes": ["fortran"] } }),
            &["runtimes", "native, python3"],
        ),
        (
            json!({ "name": "Cup", "rules": { "limits": { "pids": 1 } } }),
            &["limits.pids"],
        ),
        (
            json!({ "name": "Cup", "rules": { "game_limits": { "in_time_s": 0 } } }),
            &["game_limits.in_time_s"],
        ),
        (
            json!({ "name": "Cup", "rules": { "perturbations": { "model_mismatch": { "static_error_m": [0.9, 1] } } } }),
            &["model_mismatch"],
        ),
        (
            json!({ "name": "Cup", "settings": { "free_games_per_day": 1001 } }),
            &["settings", "expected 0 to 1000"],
        ),
        (
            json!({ "name": "Cup", "settings": { "publishes": "soon" } }),
            &["settings", "soon"],
        ),
        (json!({ "name": "Cup", "entrants": [] }), &["entrants"]),
    ] {
        let answer = create(body.clone()).await;
        assert_eq!(answer.status, 422, "{body}: {}", answer.body);
        answer.problem(422, "invalid-content", words);
    }
    create(json!({ "name": "Cup", "stage": UNKNOWN_ID }))
        .await
        .problem(404, "not-found", &["stage"]);
    create(json!({ "name": "Cup", "teams": ["A"] }))
        .await
        .json(201);
    create(json!({ "name": "cup", "teams": [] })).await.problem(
        409,
        "tournament-name-taken",
        &["cup", "another name"],
    );
    let list = site.get("/api/v1/tournaments", None).await.json(200);
    assert_eq!(list.as_array().unwrap().len(), 1, "nothing else was opened");
}

#[tokio::test]
async fn impossible_round_is_refused_with_the_reason() {
    let cup = TestTournament::open(&["A"], json!({})).await;
    let start = async || cup.post("rounds", json!({})).await;
    start()
        .await
        .problem(409, "conflict", &["at least two teams"]);
    cup.site.team("B").await;
    cup.post("entrants", json!({ "teams": ["B"] }))
        .await
        .json(200);
    let groups = json!({ "kind": "groups", "groups": 2, "advance": 1 });
    cup.change(json!({ "rules": { "format": groups } }))
        .await
        .json(200);
    start()
        .await
        .problem(409, "conflict", &["groups", "expected 1 to 1"]);
    for (body, words) in [
        (json!({ "teams": [] }), &["at least one name"][..]),
        (json!({ "teams": ["Unknown"] }), &["no team"]),
        (json!({ "teams": "A" }), &["teams"]),
    ] {
        cup.post("entrants", body)
            .await
            .problem(422, "invalid-content", words);
    }
    cup.post("entrants", json!({ "teams": ["A"] }))
        .await
        .problem(409, "conflict", &["A is in the tournament already"]);
    for (body, words) in [
        (
            json!({ "team": "A", "as": "gone", "reason": "x" }),
            &["as"][..],
        ),
        (
            json!({ "team": "A", "as": "withdrawn", "reason": " " }),
            &["reason"],
        ),
        (
            json!({ "team": "A", "as": "withdrawn", "reason": "x", "from_round": 1 }),
            &["from_round", "withdraws"],
        ),
        (
            json!({ "team": "Unknown", "as": "withdrawn", "reason": "x" }),
            &["team", "no team"],
        ),
    ] {
        cup.post("departures", body)
            .await
            .problem(422, "invalid-content", words);
    }
    let elsewhere = format!("/api/v1/tournaments/{UNKNOWN_ID}/departures");
    let departure = json!({ "team": "Unknown", "as": "withdrawn", "reason": "x" });
    cup.site
        .post(&elsewhere, Some(ADMIN), &departure)
        .await
        .problem(404, "not-found", &["tournament"]);
    cup.site.team("C").await;
    let not_entered = json!({ "team": "C", "as": "withdrawn", "reason": "x", "confirm": "C" });
    cup.post("departures", not_entered)
        .await
        .problem(409, "conflict", &["C is not in"]);
    cup.change(json!({ "baseline": UNKNOWN_ID }))
        .await
        .problem(404, "not-found", &["submission"]);
}

#[tokio::test]
async fn unknown_tournaments_and_games_are_not_found() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    for path in ["", "/games", "/ratings", "/head-to-head", "/certainty"] {
        for id in [UNKNOWN_ID, "17"] {
            let path = format!("/api/v1/tournaments/{id}{path}");
            cup.site
                .get(&path, None)
                .await
                .problem(404, "not-found", &[]);
        }
    }
    for path in ["", "/live", "/recording", "/sides/1"] {
        for id in [UNKNOWN_ID, "17"] {
            let path = format!("/api/v1/games/{id}{path}");
            cup.site
                .get(&path, None)
                .await
                .problem(404, "not-found", &[]);
        }
    }
    for query in ["round=0", "round=101", "round=x", "rounds=1"] {
        let path = format!("{}/games?{query}", cup.path);
        cup.site
            .get(&path, None)
            .await
            .problem(400, "invalid-request", &[]);
    }
    let empty = cup
        .site
        .get(&format!("{}/games?round=7", cup.path), None)
        .await
        .json(200);
    assert_eq!(empty, json!([]));
}

#[tokio::test]
async fn forfeit_counts_ten_to_zero() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    let outcome = GameOutcome {
        fouls: [3, 7],
        penalty_points: [136.0, 0.0],
        forfeits: [false, true],
        ..GameOutcome::goals(2, 4)
    };
    cup.play(|_, _| outcome).await;
    let game = cup.games().await.remove(0);
    let result = &game["result"];
    assert_eq!(
        (
            &result["score"],
            &result["goals"],
            &result["forfeits"],
            &result["won_by"]
        ),
        (
            &json!([10, 0]),
            &json!([2, 4]),
            &json!([null, "faults"]),
            &json!("forfeit")
        )
    );
    assert_eq!(
        result["because"],
        "the other side forfeited: too many faults; the winner did not lead"
    );
    assert_eq!(result["winner"], game["sides"][0]["team_name"]);
    let request = cup.site.request(Method::PUT, &cup.path, Some(ADMIN));
    let answer = Answer::read(request.send().await.unwrap()).await;
    answer.problem(405, "method-not-allowed", &[]);
}
