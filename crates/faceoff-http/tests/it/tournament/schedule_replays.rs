//! Tests of schedule replays: the whole schedule of a tournament is played again with other seeds, which shows how certain its champion
//! is. They have nothing to do with the replays that show a recorded game.

use super::{
    cup::{TestTournament, first_by_name_wins},
    fake_worker::GameOutcome,
};
use crate::site::{ADMIN, Answer, string};
use faceoff_store::GamePurpose;
use reqwest::Method;
use serde_json::{Value, json};

/// How often each team becomes champion in the replays.
async fn champion_shares(cup: &TestTournament) -> Value {
    cup.site
        .get(&format!("{}/certainty", cup.path), None)
        .await
        .json(200)
}

#[tokio::test]
async fn repeated_schedules_give_the_champion_probabilities() {
    let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
    let cup = TestTournament::open(&["A", "B", "C"], json!({ "rules": rules })).await;
    let without_replays = champion_shares(&cup).await;
    assert_eq!(
        (&without_replays["replays"], &without_replays["champions"]),
        (&json!(0), &json!([]))
    );
    cup.post("replays", json!({ "times": 1 })).await.problem(
        409,
        "conflict",
        &["0 of 1 rounds have started"],
    );
    cup.start_round().await;
    cup.play(first_by_name_wins).await;
    let before = cup.view().await;
    let started = cup.post("replays", json!({ "times": 5 })).await.json(201);
    assert_eq!(
        (&started["replays"], &started["complete"], &started["games"]),
        (&json!(5), &json!(0), &json!(15))
    );
    // In every second replay B wins all its games.
    let outcome = |game: &faceoff_store::Game, names: [&str; 2]| {
        let GamePurpose::ScheduleReplay { replay, .. } = game.purpose else {
            panic!("expected a replay");
        };
        match names {
            ["B", _] if replay % 2 == 0 => GameOutcome::goals(9, 0),
            [_, "B"] if replay % 2 == 0 => GameOutcome::goals(0, 9),
            _ => first_by_name_wins(game, names),
        }
    };
    // Four of the five schedule replays, of three games each. The fifth is cancelled.
    for _ in 0..12 {
        cup.play_next(outcome).await.unwrap();
    }
    let partial = champion_shares(&cup).await;
    assert_eq!(
        (&partial["complete"], &partial["games_played"]),
        (&json!(4), &json!(12))
    );
    let request = cup.site.request(
        Method::DELETE,
        &format!("{}/replays", cup.path),
        Some(ADMIN),
    );
    let cancelled = Answer::read(request.send().await.unwrap()).await.json(200);
    assert_eq!(
        (&cancelled["given_up"], &cancelled["games"]),
        (&json!(1), &json!(12))
    );
    assert!(cup.claim().await.is_none());
    let final_view = champion_shares(&cup).await;
    let shares: Vec<(String, &Value)> = final_view["champions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|share| (string(&share["team"]), &share["first_places"]))
        .collect();
    assert_eq!(
        shares,
        [("A".to_owned(), &json!(2)), ("B".to_owned(), &json!(2))]
    );
    let interval = &final_view["champions"][0]["share_ci95"];
    assert!(interval[0].as_f64().unwrap() < 0.5 && interval[1].as_f64().unwrap() > 0.5);
    // Replays do not count.
    assert_eq!(cup.view().await["tables"], before["tables"]);
    assert_eq!(cup.games().await.len(), 3);
    for wrong in [0, 1001] {
        cup.post("replays", json!({ "times": wrong }))
            .await
            .problem(422, "invalid-content", &["times", "1 to 1000"]);
    }
    cup.post("replays", json!({ "times": 1000 }))
        .await
        .problem(409, "conflict", &["times"]);
}

#[tokio::test]
async fn repeated_game_is_public_and_has_no_recording() {
    let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
    let cup = TestTournament::open(&["A", "B"], json!({ "rules": rules })).await;
    cup.start_round().await;
    let played = cup.play_next(first_by_name_wins).await.unwrap();
    cup.post("replays", json!({ "times": 1 })).await.json(201);
    let replayed = cup.play_next(first_by_name_wins).await.unwrap();
    assert_ne!(played.seed, replayed.seed);
    let path = format!("/api/v1/games/{}", replayed.id);
    let view = cup.site.get(&path, None).await.json(200);
    assert_eq!(
        (
            &view["purpose"],
            &view["replay"],
            &view["result"]["recording"]
        ),
        (&json!("replay"), &json!(1), &Value::Null)
    );
    cup.site
        .get(&format!("{path}/recording"), Some(ADMIN))
        .await
        .problem(409, "conflict", &["not recorded"]);
}
