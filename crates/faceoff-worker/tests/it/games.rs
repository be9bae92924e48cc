//! Games on a real server: their results do not depend on the number of slots, and hostile agents harm only themselves.

use crate::{
    server::Server,
    tournament::{all_pairs, read_from_recording, recording, rules, start_round, wait_for_results},
};
use faceoff_store::*;
use faceoff_types::TeamId;
use serde_json::{Value, json};

/// The parts of a score that do not depend on measured times.
fn without_times(score: &Value) -> Value {
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

/// Plays a round of all pairs with this number of slots. Returns the score and the hash of the motion of each game.
async fn play_round(server: &Server, teams: &[TeamId], slots: usize) -> Vec<(Value, blake3::Hash)> {
    let games = start_round(server, rules(150), &all_pairs(teams)).await;
    let worker = server.start_worker(slots);
    let results = wait_for_results(server, games[0].tournament).await;
    worker.stop().await;
    let summary = |result: &StoredGameResult| {
        let motion = read_from_recording(recording(server, result), "motion.parquet");
        (without_times(&result.results), blake3::hash(&motion))
    };
    results.iter().map(summary).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tournament_results_do_not_depend_on_slots() {
    let server = Server::new().await;
    let mut teams = Vec::new();
    for (team, swing_rad) in [("Alpha", "0.0"), ("Beta", "0.3"), ("Gamma", "0.6")] {
        let env = format!("SWING = \"{swing_rad}\"");
        teams.push(server.upload_valid(team, &env).await);
    }
    // Three servers with the same history.
    let two = server.copy().await;
    let three = server.copy().await;
    let one = Server::at(server.path()).await;
    let expected = play_round(&one, &teams, 1).await;
    assert_eq!(expected.len(), 3);
    let motions: std::collections::BTreeSet<_> = expected
        .iter()
        .map(|(_, motion)| *motion.as_bytes())
        .collect();
    assert_eq!(motions.len(), 3, "the games differ");
    assert_eq!(play_round(&two, &teams, 2).await, expected);
    assert_eq!(play_round(&three, &teams, 3).await, expected);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hostile_agents_lose_without_harming_the_opponent() {
    let server = Server::new().await;
    let harmless = server.upload_valid("Harmless", "").await;
    let mut pairs = Vec::new();
    for (team, mischief) in [
        ("Silent", "silent"),
        ("Floods", "floods"),
        ("Crashes", "crashes"),
        ("Bound", "at the bound"),
    ] {
        let env = format!("MISCHIEF = \"{mischief}\"");
        let hostile = server.upload_valid(team, &env).await;
        // On alternating sides of the table.
        let is_away = pairs.len() % 2 == 0;
        pairs.push(if is_away {
            [harmless, hostile]
        } else {
            [hostile, harmless]
        });
    }
    let mut rules = rules(30);
    rules.game_limits.max_faults = 0;
    // Only an agent that never answers exceeds this time.
    rules.limits.step_s = Some(3.0);
    let games = start_round(&server, rules, &pairs).await;
    let worker = server.start_worker(1);
    let results = wait_for_results(&server, games[0].tournament).await;
    worker.stop().await;
    for (game, result) in games.iter().zip(&results) {
        let score = &result.results;
        let side = usize::from(game.teams[0] != harmless);
        let (harmless, hostile) = (&score["sides"][side], &score["sides"][1 - side]);
        let counts = (&harmless["faults"], &harmless["fouls"]);
        assert_eq!(counts, (&json!(0), &json!(0)));
        for kind in ["ee", "link", "joint_pos", "joint_vel"] {
            assert_eq!(harmless["violations"][kind], 0, "{score}");
        }
        assert!(harmless.get("forfeit").is_none(), "{score}");
        // The last pair's hostile agent sends numbers at the bound. They are valid answers as long as the world does not
        // diverge.
        if score["end"] == "played" {
            assert_eq!(game.teams[1 - side], pairs[3][1 - side]);
        } else {
            assert_eq!(hostile["faults"], 1, "{score}");
            assert_eq!(score["winner"], side, "{score}");
            let scores = (&harmless["score"], &hostile["score"]);
            assert_eq!(scores, (&json!(10), &json!(0)));
        }
        let attempts = server.store.game_attempts(game.id).await.unwrap();
        assert_eq!(attempts.len(), 1, "no attempt fails: {attempts:?}");
    }
    let messages = ["step limit", "", "exited with status 4"];
    // The index of the hostile agent's side in each game.
    for ((game, side), message) in games.iter().zip([1, 0, 1]).zip(messages) {
        let side = faceoff_types::Side::BOTH[side];
        let log = server.store.game_log(game.id, side).await.unwrap().unwrap();
        assert!(log.contains("an agent's log"), "{log}");
        assert!(log.contains(message), "{log}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn late_answers_are_no_fault_and_do_not_affect_the_opponent() {
    let server = Server::new().await;
    let punctual = server.upload_valid("Punctual", "").await;
    let late = server
        .upload_valid("Late", "MISCHIEF = \"slow\"\nSWING = \"0.5\"")
        .await;
    let mut rules = rules(30);
    rules.game_limits.max_answer_s = 0.02;
    let games = start_round(&server, rules, &[[late, punctual]]).await;
    let worker = server.start_worker(1);
    let results = wait_for_results(&server, games[0].tournament).await;
    worker.stop().await;
    let score = &results[0].results;
    let [late, punctual] = [&score["sides"][0], &score["sides"][1]];
    assert_eq!(score["end"], "played");
    assert_eq!(
        (&late["faults"], &punctual["faults"]),
        (&json!(0), &json!(0))
    );
    assert!(late["late_answers"].as_u64().unwrap() > 0, "{score}");
    assert!(late["violations"]["computation_time"] == 1, "{score}");
    for kind in ["ee", "link", "joint_pos", "joint_vel"] {
        assert_eq!(punctual["violations"][kind], 0, "{score}");
    }
}
