//! Tests of access to the files of games: recordings and logs.

use super::cup::{TestTournament, first_by_name_wins};
use crate::site::{ADMIN, string};
use serde_json::{Value, json};

/// The status of a request for each file: the recording of both sides, of each side, and the first side's log.
async fn file_statuses(cup: &TestTournament, game: &str, token: Option<&str>) -> [u16; 4] {
    let mut statuses = Vec::new();
    for file in ["recording", "sides/1", "sides/2", "sides/1/log"] {
        let answer = cup
            .site
            .get(&format!("/api/v1/games/{game}/{file}"), token)
            .await;
        statuses.push(answer.status.as_u16());
    }
    statuses.try_into().unwrap()
}

/// The game's seed, as the caller sees it; null if it is hidden.
async fn visible_seed(cup: &TestTournament, game: &str, token: Option<&str>) -> Value {
    let view = cup
        .site
        .get(&format!("/api/v1/games/{game}"), token)
        .await
        .json(200);
    view["result"]["recording"]["seed"].clone()
}

#[tokio::test]
async fn own_side_is_available_at_once_and_both_once_published() {
    for (publishes, is_public_after_round, is_public_after_closing) in [
        ("at_release", true, true),
        ("at_close", false, true),
        ("never", false, false),
    ] {
        let cup = TestTournament::start_round_robin(publishes).await;
        let queued = string(&cup.games().await[0]["id"]);
        assert_eq!(
            file_statuses(&cup, &queued, Some(ADMIN)).await,
            [409; 4],
            "there is no recording yet"
        );
        let game = cup.play_next(first_by_name_wins).await.unwrap();
        let [home, away] = cup.names(&game).await;
        let third_team = ["A", "B", "C"]
            .into_iter()
            .find(|name| *name != home && *name != away)
            .unwrap();
        let id = game.id.to_string();
        // While the round is open, each team may download its own side only.
        assert_eq!(file_statuses(&cup, &id, None).await, [401; 4]);
        assert_eq!(
            file_statuses(&cup, &id, Some(cup.token(&home))).await,
            [403, 200, 403, 200]
        );
        assert_eq!(
            file_statuses(&cup, &id, Some(cup.token(&away))).await,
            [403, 403, 200, 403]
        );
        assert_eq!(
            file_statuses(&cup, &id, Some(cup.token(third_team))).await,
            [403; 4]
        );
        assert_eq!(file_statuses(&cup, &id, Some(ADMIN)).await, [200; 4]);
        assert_eq!(
            visible_seed(&cup, &id, Some(cup.token(&home))).await,
            Value::Null
        );
        assert_ne!(visible_seed(&cup, &id, Some(ADMIN)).await, Value::Null);
        cup.play(first_by_name_wins).await;
        let public_statuses = |public: bool| {
            if public {
                [200, 200, 200, 401]
            } else {
                [401; 4]
            }
        };
        assert_eq!(
            file_statuses(&cup, &id, None).await,
            public_statuses(is_public_after_round),
            "{publishes}, over"
        );
        cup.post("close", json!({ "confirm": "Cup" }))
            .await
            .json(200);
        assert_eq!(
            file_statuses(&cup, &id, None).await,
            public_statuses(is_public_after_closing),
            "{publishes}, closed"
        );
        assert_eq!(
            visible_seed(&cup, &id, None).await.is_string(),
            is_public_after_closing
        );
        let view = cup
            .site
            .get(&format!("/api/v1/games/{id}"), None)
            .await
            .json(200);
        assert_eq!(
            view["result"]["recording"]["public"],
            is_public_after_closing
        );
        // The log of an agent stays private to its team.
        let log = cup
            .site
            .get(
                &format!("/api/v1/games/{id}/sides/2/log"),
                Some(cup.token(&away)),
            )
            .await;
        assert_eq!(log.body, format!("{away} was here\n"));
        assert!(log.header("content-type").starts_with("text/plain"));
        assert_eq!(
            file_statuses(&cup, &id, Some(cup.token(third_team))).await[3],
            403
        );
    }
}

#[tokio::test]
async fn downloaded_files_match_the_hashes_in_the_game() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, away] = cup.names(&game).await;
    let path = format!("/api/v1/games/{}", game.id);
    let recording = cup.site.get(&path, Some(ADMIN)).await.json(200)["result"]["recording"].clone();
    for (resource, hash, file) in [
        ("recording", &recording["game_blake3"], "game.zip"),
        ("sides/1", &recording["side_blake3"][0], "side-1.zip"),
        ("sides/2", &recording["side_blake3"][1], "side-2.zip"),
    ] {
        let answer = cup
            .site
            .get(&format!("{path}/{resource}"), Some(ADMIN))
            .await;
        assert_eq!(
            *hash,
            json!(blake3::hash(answer.body.as_bytes()).to_string())
        );
        assert_eq!(answer.header("content-type"), "application/zip");
        let name = format!("attachment; filename=\"faceoff-{home}-{away}-{file}\"");
        assert_eq!(answer.header("content-disposition"), name);
    }
    for wrong in ["sides/0", "sides/3", "sides/home", "sides/1/wav"] {
        let answer = cup.site.get(&format!("{path}/{wrong}"), Some(ADMIN)).await;
        answer.problem(404, "not-found", &[]);
    }
}
