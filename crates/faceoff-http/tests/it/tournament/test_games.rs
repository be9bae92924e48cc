//! Tests of test games (against the organisers' baseline) and friendly games (between two teams): their visibility and quotas,
//! and when they are allowed.

use super::{cup::TestTournament, fake_worker::GameOutcome};
use crate::{
    site::{ADMIN, Answer, string},
    users::member,
};
use reqwest::Method;
use serde_json::{Value, json};

/// A tournament whose baseline, the opponent in test games, is a submission of an additional team.
async fn cup_with_baseline(names: &[&str], settings: Value) -> TestTournament {
    let mut cup = TestTournament::open(names, json!({ "settings": settings })).await;
    let body = json!({});
    cup.site
        .post(
            &format!("{}/test-games", cup.path),
            Some(cup.token(names[0])),
            &body,
        )
        .await
        .problem(409, "conflict", &["no baseline"]);
    cup.add_team("Organisers").await;
    let submissions = cup
        .site
        .get("/api/v1/submissions", Some(cup.token("Organisers")))
        .await
        .json(200);
    let changed = cup
        .change(json!({ "baseline": submissions[0]["id"] }))
        .await
        .json(200);
    assert_eq!(changed["baseline"], submissions[0]["id"]);
    cup
}

/// A team requests a test game.
async fn request_test_game(cup: &TestTournament, team: &str) -> Answer {
    let path = format!("{}/test-games", cup.path);
    cup.site
        .post(&path, Some(cup.token(team)), &json!({}))
        .await
}

/// A team requests a friendly game.
async fn request_friendly_game(cup: &TestTournament, team: &str, opponent: &str) -> Answer {
    let path = format!("{}/friendly-games", cup.path);
    let body = json!({ "opponent": opponent });
    cup.site.post(&path, Some(cup.token(team)), &body).await
}

async fn delete(cup: &TestTournament, path: &str, token: &str) -> Answer {
    let request = cup.site.request(Method::DELETE, path, Some(token));
    Answer::read(request.send().await.unwrap()).await
}

#[tokio::test]
async fn test_game_is_private_and_does_not_count() {
    let cup = cup_with_baseline(&["A", "B"], json!({})).await;
    let created = request_test_game(&cup, "A").await.json(201);
    let game = &created["queued"][0];
    assert_eq!(
        (
            &game["purpose"],
            &game["requested_by"],
            &game["sides"][1]["team_name"]
        ),
        (&json!("test"), &json!("A"), &json!("Organisers"))
    );
    let path = format!("/api/v1/games/{}", string(&game["id"]));
    cup.play_next(|_, _| GameOutcome::goals(3, 0))
        .await
        .unwrap();
    for (token, is_visible) in [
        (None, false),
        (Some(cup.token("B")), false),
        (Some(cup.token("A")), true),
        (Some(cup.token("Organisers")), true),
        (Some(ADMIN), true),
    ] {
        for resource in ["", "/live", "/recording", "/sides/1"] {
            let answer = cup.site.get(&format!("{path}{resource}"), token).await;
            assert_eq!(
                answer.status != 404,
                is_visible,
                "{resource} {}",
                answer.body
            );
        }
    }
    // The team may download its own side at once, but never both sides, which contain the seed.
    let own_side = cup
        .site
        .get(&format!("{path}/sides/1"), Some(cup.token("A")))
        .await;
    assert!(own_side.body.starts_with("PK side-1.zip"));
    cup.site
        .get(&format!("{path}/recording"), Some(cup.token("A")))
        .await
        .problem(403, "forbidden", &["never becomes public"]);
    let view = cup.view().await;
    assert_eq!(view["tables"][0]["standings"], json!([]));
    assert_eq!(cup.games().await, Vec::<Value>::new());
    let count_listed_games = async |token: &str| {
        let path = format!("{}/uncounted-games", cup.path);
        cup.site
            .get(&path, Some(token))
            .await
            .json(200)
            .as_array()
            .unwrap()
            .len()
    };
    assert_eq!(
        [
            count_listed_games(cup.token("A")).await,
            count_listed_games(cup.token("B")).await,
            count_listed_games(ADMIN).await
        ],
        [1, 0, 1]
    );
}

#[tokio::test]
async fn daily_quota_of_test_games_applies_to_teams_only() {
    let cup = cup_with_baseline(&["A", "B"], json!({ "free_games_per_day": 2 })).await;
    request_test_game(&cup, "A").await.json(201);
    let created = request_friendly_game(&cup, "A", "B").await;
    assert_eq!(
        created.header("location"),
        format!("/api/v1/games/{}", string(&created.json(201)["id"]))
    );
    let refused = request_test_game(&cup, "A").await;
    let problem = refused.problem(
        429,
        "daily-game-quota-exceeded",
        &["at most 2", "requested 2"],
    );
    assert_eq!(
        (&problem["limit"], &problem["used"]),
        (&json!(2), &json!(2))
    );
    // It is ten o'clock, and the quota starts again at midnight.
    assert_eq!(refused.header("retry-after"), (14 * 3600).to_string());
    request_friendly_game(&cup, "A", "B")
        .await
        .problem(429, "daily-game-quota-exceeded", &[]);
    // B has its own quota, and organisers have no limit.
    request_friendly_game(&cup, "B", "a").await.json(201);
    let created = cup.post("test-games", json!({})).await.json(201);
    assert_eq!(created["queued"].as_array().unwrap().len(), 2);
    let with_baseline_team = cup
        .post("test-games", json!({ "teams": ["A", "Organisers"] }))
        .await;
    with_baseline_team.problem(
        409,
        "conflict",
        &["Organisers", "cannot play against itself"],
    );
    cup.site.next_day();
    request_test_game(&cup, "A").await.json(201);
    // A team cannot start test games of another team.
    let path = format!("{}/test-games", cup.path);
    let body = json!({ "teams": ["B"] });
    cup.site
        .post(&path, Some(cup.token("A")), &body)
        .await
        .problem(403, "forbidden", &["only for itself"]);
}

#[tokio::test]
async fn team_declines_and_cancels_friendly_games() {
    let cup = cup_with_baseline(&["A", "B"], json!({})).await;
    let bob = member(&cup.site, &cup.teams["B"].id, "Bob").await.token;
    let team = format!("/api/v1/teams/{}", cup.teams["B"].id);
    let set_declines = async |declines: bool| {
        let body = json!({ "declines_friendly_games": declines });
        let changed = cup.site.patch(&team, Some(&bob), &body).await;
        changed.json(200)
    };
    assert_eq!(
        cup.site.get(&team, None).await.json(200)["declines_friendly_games"],
        false
    );
    let queued = request_friendly_game(&cup, "A", "B").await.json(201);
    assert_eq!(set_declines(true).await["declines_friendly_games"], true);
    request_friendly_game(&cup, "A", "B").await.problem(
        409,
        "conflict",
        &["B plays no friendly games"],
    );
    // B may still request friendly games itself.
    request_friendly_game(&cup, "B", "A").await.json(201);
    assert_eq!(set_declines(false).await["declines_friendly_games"], false);
    request_friendly_game(&cup, "A", "B").await.json(201);

    let path = format!("/api/v1/games/{}", string(&queued["id"]));
    delete(&cup, &path, cup.token("B"))
        .await
        .problem(403, "forbidden", &["requested the game"]);
    let cancelled = delete(&cup, &path, cup.token("A")).await.json(200);
    assert_eq!(
        (&cancelled["state"], &cancelled["reason"]),
        (&json!("cancelled"), &json!("by A, which had requested it"))
    );
    delete(&cup, &path, ADMIN)
        .await
        .problem(409, "conflict", &["over already"]);
    cup.site
        .get(&format!("{path}/sides/1"), Some(cup.token("A")))
        .await
        .problem(409, "conflict", &["cancelled"]);
}

#[tokio::test]
async fn test_games_are_refused_during_a_round() {
    let cup = cup_with_baseline(&["A", "B"], json!({})).await;
    cup.start_round().await;
    for answer in [
        request_test_game(&cup, "A").await,
        request_friendly_game(&cup, "A", "B").await,
    ] {
        answer.problem(409, "conflict", &["a round is under way"]);
    }
    let round_game = string(&cup.games().await[0]["id"]);
    let path = format!("/api/v1/games/{round_game}");
    delete(&cup, &path, ADMIN)
        .await
        .problem(409, "conflict", &["of the schedule"]);
    cup.play(|_, _| GameOutcome::goals(1, 0)).await;
    request_test_game(&cup, "A").await.json(201);
    // A team that is not in the tournament has no friendly games.
    request_friendly_game(&cup, "Organisers", "A")
        .await
        .problem(409, "conflict", &["not in the tournament"]);
}
