//! Games on the server: independent of slots, and with hostile opponents.

use crate::{
    server::Server,
    tournament::{file_of, pairs, recording, results, rules, start},
};
use faceoff_store::*;
use faceoff_types::TeamId;
use serde_json::{Value, json};

/// The parts of a score that do not depend on measured times.
fn timeless(score: &Value) -> Value {
    let side = |side: &Value| {
        json!([
            side["goals"],
            side["fouls"],
            side["score"],
            side["faults"],
            side["late_answers"],
            side["violations"]["ee"],
            side["violations"]["link"],
            side["violations"]["joint_pos"],
            side["violations"]["joint_vel"],
        ])
    };
    json!([
        score["seed"],
        score["steps"],
        score["rallies"],
        score["end"],
        side(&score["sides"][0]),
        side(&score["sides"][1]),
    ])
}

/// Plays a round with this number of slots; the score and the hash of the motion of each game.
async fn play(server: &Server, teams: &[TeamId], slots: usize) -> Vec<(Value, blake3::Hash)> {
    let games = start(server, rules(150), &pairs(teams)).await;
    let worker = server.start_worker(slots);
    let results = results(server, games[0].tournament).await;
    worker.stop().await;
    let summary = |result: &GameResultRow| {
        let motion = file_of(recording(server, result), "motion.parquet");
        (timeless(&result.score), blake3::hash(&motion))
    };
    results.iter().map(summary).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tournament_results_do_not_depend_on_slots() {
    let server = Server::new().await;
    let mut teams = Vec::new();
    for (team, swing) in [("Alpha", 0), ("Beta", 3), ("Gamma", 6)] {
        let env = format!("SWING = \"0.{swing}\"");
        teams.push(server.valid(team, &env).await);
    }
    // Three servers with the same history.
    let two = server.copy().await;
    let three = server.copy().await;
    let one = Server::at(server.path()).await;
    let expected = play(&one, &teams, 1).await;
    assert_eq!(expected.len(), 3);
    let motions: std::collections::BTreeSet<_> = expected
        .iter()
        .map(|(_, motion)| *motion.as_bytes())
        .collect();
    assert_eq!(motions.len(), 3, "the games differ");
    assert_eq!(play(&two, &teams, 2).await, expected);
    assert_eq!(play(&three, &teams, 3).await, expected);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hostile_agents_lose_without_harming_the_opponent() {
    let server = Server::new().await;
    let hold = server.valid("Hold", "").await;
    let mut pairs = Vec::new();
    for (team, mischief) in [
        ("Silent", "silent"),
        ("Floods", "floods"),
        ("Crashes", "crashes"),
        ("Bound", "at the bound"),
    ] {
        let env = format!("MISCHIEF = \"{mischief}\"");
        let hostile = server.valid(team, &env).await;
        // On alternating sides of the table.
        let is_away = pairs.len() % 2 == 0;
        pairs.push(if is_away {
            [hold, hostile]
        } else {
            [hostile, hold]
        });
    }
    let mut rules = rules(30);
    rules.game_limits.max_faults = 0;
    // Only an agent that never answers exceeds it.
    rules.limits.step_s = Some(3.0);
    let games = start(&server, rules, &pairs).await;
    let worker = server.start_worker(1);
    let results = results(&server, games[0].tournament).await;
    worker.stop().await;
    for (game, result) in games.iter().zip(&results) {
        let score = &result.score;
        let at = usize::from(game.teams[0] != hold);
        let (own, other) = (&score["sides"][at], &score["sides"][1 - at]);
        assert_eq!((&own["faults"], &own["fouls"]), (&json!(0), &json!(0)));
        for kind in ["ee", "link", "joint_pos", "joint_vel"] {
            assert_eq!(own["violations"][kind], 0, "{score}");
        }
        assert!(own.get("forfeit").is_none(), "{score}");
        // Numbers at the bound are valid answers as long as the world does not diverge.
        if score["end"] == "played" {
            assert_eq!(game.teams[1 - at], pairs[3][1 - at]);
        } else {
            assert_eq!(other["faults"], 1, "{score}");
            assert_eq!(score["winner"], at, "{score}");
            assert_eq!((&own["score"], &other["score"]), (&json!(10), &json!(0)));
        }
        let attempts = server.store.game_attempts(game.id).await.unwrap();
        assert_eq!(attempts.len(), 1, "no attempt fails: {attempts:?}");
    }
    let messages = ["step limit", "", "exited with status 4"];
    for ((game, side), message) in games.iter().zip([1, 0, 1]).zip(messages) {
        let side = faceoff_types::Side::BOTH[side];
        let log = server.store.game_log(game.id, side).await.unwrap().unwrap();
        assert!(log.contains("an agent's log"), "{log}");
        assert!(log.contains(message), "{log}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn late_answers_are_no_fault_and_harmless() {
    let server = Server::new().await;
    let hold = server.valid("Hold", "").await;
    let late = server
        .valid("Late", "MISCHIEF = \"slow\"\nSWING = \"0.5\"")
        .await;
    let mut rules = rules(30);
    rules.game_limits.in_time_s = 0.02;
    let games = start(&server, rules, &[[late, hold]]).await;
    let worker = server.start_worker(1);
    let results = results(&server, games[0].tournament).await;
    worker.stop().await;
    let score = &results[0].score;
    let [slow, other] = [&score["sides"][0], &score["sides"][1]];
    assert_eq!(score["end"], "played");
    assert_eq!((&slow["faults"], &other["faults"]), (&json!(0), &json!(0)));
    assert!(slow["late_answers"].as_u64().unwrap() > 0, "{score}");
    assert!(slow["violations"]["computation_time"] == 1, "{score}");
    for kind in ["ee", "link", "joint_pos", "joint_vel"] {
        assert_eq!(other["violations"][kind], 0, "{score}");
    }
}
