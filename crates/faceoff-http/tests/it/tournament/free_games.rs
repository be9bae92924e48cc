//! Games that do not count: whose they are, how many there may be, and when.

use super::{cup::Cup, slot::Went};
use crate::site::{ADMIN, Answer, text};
use reqwest::Method;
use serde_json::{Value, json};

/// With a baseline by a team of its own.
async fn with_baseline(names: &[&str], settings: Value) -> Cup {
    let mut cup = Cup::open(names, json!({ "settings": settings })).await;
    let body = json!({});
    cup.site
        .post(
            &format!("{}/test-games", cup.path),
            Some(cup.token(names[0])),
            &body,
        )
        .await
        .problem(409, "conflict", &["no baseline"]);
    cup.late_team("Organisers").await;
    let own = cup
        .site
        .get("/api/v1/submissions", Some(cup.token("Organisers")))
        .await
        .json(200);
    let changed = cup
        .change(json!({ "baseline": own[0]["id"] }))
        .await
        .json(200);
    assert_eq!(changed["baseline"], own[0]["id"]);
    cup
}

async fn test_game(cup: &Cup, team: &str) -> Answer {
    let path = format!("{}/test-games", cup.path);
    cup.site
        .post(&path, Some(cup.token(team)), &json!({}))
        .await
}

async fn friendly(cup: &Cup, team: &str, opponent: &str) -> Answer {
    let path = format!("{}/friendly-games", cup.path);
    let body = json!({ "opponent": opponent });
    cup.site.post(&path, Some(cup.token(team)), &body).await
}

async fn delete(cup: &Cup, path: &str, token: &str) -> Answer {
    let request = cup.site.request(Method::DELETE, path, Some(token));
    Answer::of(request.send().await.unwrap()).await
}

#[tokio::test]
async fn a_test_game_is_its_teams_and_the_organisers_alone_and_never_counts() {
    let cup = with_baseline(&["A", "B"], json!({})).await;
    let ordered = test_game(&cup, "A").await.json(201);
    let game = &ordered["ordered"][0];
    assert_eq!(
        (
            &game["purpose"],
            &game["asked_by"],
            &game["sides"][1]["team_name"]
        ),
        (&json!("test"), &json!("A"), &json!("Organisers"))
    );
    let path = format!("/api/v1/games/{}", text(&game["id"]));
    cup.play_next(|_, _| Went::goals(3, 0)).await.unwrap();
    for (token, sees) in [
        (None, false),
        (Some(cup.token("B")), false),
        (Some(cup.token("A")), true),
        (Some(cup.token("Organisers")), true),
        (Some(ADMIN), true),
    ] {
        for what in ["", "/live", "/recording", "/sides/1"] {
            let answer = cup.site.get(&format!("{path}{what}"), token).await;
            assert_eq!(answer.status != 404, sees, "{what} {}", answer.body);
        }
    }
    // Its own side at once; both sides, with the seed, never.
    let own = cup
        .site
        .get(&format!("{path}/sides/1"), Some(cup.token("A")))
        .await;
    assert!(own.body.starts_with("PK side-1.zip"));
    cup.site
        .get(&format!("{path}/recording"), Some(cup.token("A")))
        .await
        .problem(403, "forbidden", &["never there for everybody"]);
    let view = cup.view().await;
    assert_eq!(view["tables"][0]["standings"], json!([]));
    assert_eq!(cup.games().await, Vec::<Value>::new());
    let listed = async |token: &str| {
        let path = format!("{}/free-games", cup.path);
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
            listed(cup.token("A")).await,
            listed(cup.token("B")).await,
            listed(ADMIN).await
        ],
        [1, 0, 1]
    );
}

#[tokio::test]
async fn a_team_asks_for_so_many_a_day_and_an_organiser_for_all() {
    let cup = with_baseline(&["A", "B"], json!({ "free_games_per_day": 2 })).await;
    test_game(&cup, "A").await.json(201);
    let played = friendly(&cup, "A", "B").await;
    assert_eq!(
        played.header("location"),
        format!("/api/v1/games/{}", text(&played.json(201)["id"]))
    );
    let spent = test_game(&cup, "A").await;
    let problem = spent.problem(429, "free-games-spent", &["at most 2", "asked for 2"]);
    assert_eq!(
        (&problem["limit"], &problem["used"]),
        (&json!(2), &json!(2))
    );
    assert_eq!(
        spent.header("retry-after"),
        "50400",
        "from ten o'clock to midnight"
    );
    friendly(&cup, "A", "B")
        .await
        .problem(429, "free-games-spent", &[]);
    // B has its own quota, and the organiser none.
    friendly(&cup, "B", "a").await.json(201);
    let all = cup.post("test-games", json!({})).await.json(201);
    assert_eq!(all["ordered"].as_array().unwrap().len(), 2);
    let some = cup
        .post("test-games", json!({ "teams": ["A", "Organisers"] }))
        .await;
    some.problem(409, "conflict", &["Organisers", "cannot play itself"]);
    cup.site.next_day();
    test_game(&cup, "A").await.json(201);
    // Another team's agent is nobody's to test.
    let path = format!("{}/test-games", cup.path);
    let body = json!({ "teams": ["B"] });
    cup.site
        .post(&path, Some(cup.token("A")), &body)
        .await
        .problem(403, "forbidden", &["its own agent"]);
}

#[tokio::test]
async fn a_team_may_decline_friendly_games_and_call_off_what_it_asked_for() {
    let cup = with_baseline(&["A", "B"], json!({})).await;
    let invitation = json!({ "role": "member", "team": cup.teams["B"].id, "note": "Bob" });
    let made = cup
        .site
        .post("/api/v1/invitations", Some(ADMIN), &invitation)
        .await
        .json(201);
    let join = json!({ "code": made["code"], "name": "Bob" });
    let joined = cup
        .site
        .post("/api/v1/invitations/accept", None, &join)
        .await
        .json(201);
    let bob = text(&joined["secret"]);
    let team = format!("/api/v1/teams/{}", cup.teams["B"].id);
    let set = async |declines: bool| {
        let request = cup.site.request(Method::PATCH, &team, Some(&bob));
        let body = json!({ "declines_friendly_games": declines });
        Answer::of(request.json(&body).send().await.unwrap())
            .await
            .json(200)
    };
    assert_eq!(
        cup.site.get(&team, None).await.json(200)["declines_friendly_games"],
        false
    );
    let queued = friendly(&cup, "A", "B").await.json(201);
    assert_eq!(set(true).await["declines_friendly_games"], true);
    friendly(&cup, "A", "B")
        .await
        .problem(409, "conflict", &["B plays no friendly games"]);
    // It may still ask itself.
    friendly(&cup, "B", "A").await.json(201);
    assert_eq!(set(false).await["declines_friendly_games"], false);
    friendly(&cup, "A", "B").await.json(201);

    let path = format!("/api/v1/games/{}", text(&queued["id"]));
    delete(&cup, &path, cup.token("B"))
        .await
        .problem(403, "forbidden", &["who asked"]);
    let off = delete(&cup, &path, cup.token("A")).await.json(200);
    assert_eq!(
        (&off["state"], &off["reason"]),
        (&json!("cancelled"), &json!("by A, which had asked for it"))
    );
    delete(&cup, &path, ADMIN)
        .await
        .problem(409, "conflict", &["over already"]);
    cup.site
        .get(&format!("{path}/sides/1"), Some(cup.token("A")))
        .await
        .problem(409, "conflict", &["called off"]);
}

#[tokio::test]
async fn free_games_are_played_before_and_between_rounds_only() {
    let cup = with_baseline(&["A", "B"], json!({})).await;
    cup.start_round().await;
    for answer in [test_game(&cup, "A").await, friendly(&cup, "A", "B").await] {
        answer.problem(409, "conflict", &["a round is under way"]);
    }
    let round = text(&cup.games().await[0]["id"]);
    let path = format!("/api/v1/games/{round}");
    delete(&cup, &path, ADMIN)
        .await
        .problem(409, "conflict", &["of the schedule"]);
    cup.play(|_, _| Went::goals(1, 0)).await;
    test_game(&cup, "A").await.json(201);
    // Who is in no tournament has no free games.
    friendly(&cup, "Organisers", "A")
        .await
        .problem(409, "conflict", &["not in the tournament"]);
}
