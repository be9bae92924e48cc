//! Tests of the input files `tasks.json` and `games.json`: valid input, and errors that name the wrong value.

use crate::support::{bounds, read, team, weights};
use faceoff_scoring::{
    QualifyingRow, QualifyingScores,
    tournament::{PlayedGame, score_tournament},
};
use serde_json::{Value, json};

/// The results of a team in `tasks.json`.
const TASKS: &str = r#"{
    "hit": {"success_rate": 0.5, "penalty_points": 10},
    "defend": {"success_rate": 0.5, "penalty_points": 10},
    "prepare": {"success_rate": 0.5, "penalty_points": 10}
}"#;

/// The board of a `tasks.json`, or the error.
fn board(file: &str) -> Result<Vec<QualifyingRow>, String> {
    let scores = read::<QualifyingScores>(file)?;
    let board = scores.board(&weights(), bounds());
    board.map_err(|error| error.to_string())
}

/// Asserts that the file is refused with an error that contains all `words`.
#[track_caller]
fn assert_refused(file: &str, words: &[&str]) {
    let error = board(file).unwrap_err();
    for word in words {
        assert!(error.contains(word), "{word:?} is not in: {error}");
    }
}

/// A `tasks.json` with one team, whose `defend` is the given JSON.
fn with_defend(defend: &str) -> String {
    let mut tasks: Value = serde_json::from_str(TASKS).unwrap();
    tasks["defend"] = json!("DEFEND");
    format!(r#"{{"Alpha": {tasks}}}"#).replace(r#""DEFEND""#, defend)
}

#[test]
fn impossible_numbers_are_refused_with_their_path() {
    let score = |rate: &str, points: &str| {
        with_defend(&format!(
            r#"{{"success_rate": {rate}, "penalty_points": {points}}}"#
        ))
    };
    assert_refused(
        &score("54.9", "0"),
        &["Alpha.defend", "success_rate", "0 to 1", "54.9", "divide"],
    );
    assert_refused(
        &score("-0.1", "0"),
        &["Alpha.defend", "success_rate", "-0.1"],
    );
    assert_refused(
        &score("0.5", "-1"),
        &["Alpha.defend", "penalty_points", "got -1"],
    );
    // All violations of an episode cost 11 points; a task has 1000 episodes.
    assert_refused(
        &score("0.5", "11000.5"),
        &["Alpha.defend", "penalty_points", "11000", "11000.5"],
    );
    assert_refused(
        &score("1e999", "0"),
        &["Alpha.defend.success_rate", "out of range"],
    );
    assert_refused(&score("NaN", "0"), &["Alpha.defend.success_rate"]);
    assert_refused(
        &score("\"0.5\"", "0"),
        &["Alpha.defend.success_rate", "string", "expected f64"],
    );
    assert_refused(&score("null", "0"), &["Alpha.defend.success_rate", "null"]);
    assert_refused(
        &with_defend("{}"),
        &["Alpha.defend", "missing field `success_rate`"],
    );
    assert_refused(&with_defend("7"), &["Alpha.defend", "expected"]);
    assert_refused(
        &with_defend(r#"{"success_rate": 1, "penalty_points": 0, "episodes": 0}"#),
        &["Alpha.defend", "episodes", "at least 1"],
    );
    assert_refused(
        &with_defend(r#"{"success_rate": 1, "penalty_point": 0}"#),
        &["Alpha.defend", "unknown field `penalty_point`"],
    );
}

#[test]
fn duplicate_and_unknown_teams_and_tasks_are_refused() {
    assert_refused(
        &format!(r#"{{"Alpha": {TASKS}, "Beta": {TASKS}, "Alpha": {TASKS}}}"#),
        &["Alpha occurs twice"],
    );
    let score = r#"{"success_rate": 0, "penalty_points": 0}"#;
    assert_refused(
        &format!(r#"{{"Alpha": {{"hit": {score}}}}}"#),
        &["Alpha", "task defend is missing"],
    );
    assert_refused(
        &format!(r#"{{"Alpha": {{"hit": {score}, "hit": {score}}}}}"#),
        &["Alpha", "hit occurs twice"],
    );
    assert_refused(
        &format!(r#"{{"Alpha": {{"hti": {score}}}}}"#),
        &["Alpha", "unknown task \"hti\"", "hit, defend or prepare"],
    );
    assert_refused(&format!(r#"{{"<b>": {TASKS}}}"#), &["<b>", "letters"]);
    assert_refused(&format!(r#"{{"": {TASKS}}}"#), &["1 to 40 characters"]);
    assert_refused("[]", &["expected an object"]);
}

#[test]
fn empty_file_gives_empty_board() {
    assert_eq!(board("{}").unwrap(), []);
    let empty = score_tournament(&read::<Vec<PlayedGame>>("[]").unwrap());
    assert_eq!(
        serde_json::to_value(&empty).unwrap(),
        json!({"games": [], "standings": []})
    );
}

#[test]
fn tied_teams_keep_order_of_the_file() {
    let file = format!(r#"{{"Zulu": {TASKS}, "Alpha": {TASKS}}}"#);
    let board = board(&file).unwrap();
    let ranking: Vec<_> = board
        .iter()
        .map(|row| (row.rank, row.team.as_str()))
        .collect();
    assert_eq!(ranking, [(1, "Zulu"), (2, "Alpha")]);
}

#[test]
fn tasks_of_results_json_are_valid_input() {
    let results = json!({
        "episodes": 50, "successes": 20, "success_rate": 0.4, "success_ci95": [0.2, 0.6],
        "penalty_points": 30.0, "tier": "improvable", "steps": 9000,
        "violations": {"ee": 10, "link": 0, "joint_pos": 0, "joint_vel": 0, "computation_time": 0},
        "computation_time_s": {"mean": 0.001, "p99": 0.002, "max": 0.003},
    });
    let file = json!({"Alpha": {"hit": results, "defend": results, "prepare": results}});
    let row = &board(&file.to_string()).unwrap()[0];
    let row = serde_json::to_value(row).unwrap();
    assert_eq!(
        (&row["score"], &row["penalty_points"]),
        (&json!(40.0), &json!(30.0))
    );
    assert_eq!(row["tier"], "improvable", "30 points over 50 episodes");
    assert_eq!(row["tasks"]["hit"]["episodes"], 50);
}

/// A `games.json` with one game, in which `changes` replace fields; null removes a field.
fn game(changes: Value) -> String {
    let mut game = json!({
        "round": 1, "home": "Alpha", "away": "Beta", "goals": [3, 2], "fouls": [4, 7],
        "penalty_points": [62.0, 100.5],
    });
    for (field, value) in changes.as_object().unwrap() {
        if value.is_null() {
            game.as_object_mut().unwrap().remove(field);
        } else {
            game[field] = value.clone();
        }
    }
    format!("[{game}]")
}

#[test]
fn final_score_follows_from_fouls() {
    // The score is the goals plus a point for every third foul of the opponent: 3 + 2 and 2 + 1. `winner_led`: the winner had the higher
    // score, whether or not it decided.
    let scored = score_tournament(&read::<Vec<PlayedGame>>(&game(json!({}))).unwrap());
    assert_eq!(
        serde_json::to_value(&scored.games[0]).unwrap(),
        json!({
            "round": 1, "home": "Alpha", "away": "Beta", "goals": [3, 2], "fouls": [4, 7],
            "penalty_points": [62.0, 100.5], "score": [5, 3], "winner": "Alpha",
            "won_by": "score", "winner_led": true,
        })
    );
    assert_eq!(
        scored.standings[0].goals_for, 3,
        "goals, not points for fouls"
    );
    // Both may be given if they agree.
    read::<Vec<PlayedGame>>(&game(json!({"score": [5, 3]}))).unwrap();
    // Penalty points are counted per window of 500 steps, 90 in a normal game. More than 1.5 points per window make a side non-deployable
    // (unsafe for the real robot), so that it loses: here 100.5 points in 60 windows.
    let short = read::<Vec<PlayedGame>>(&game(json!({"windows": 60, "goals": [0, 9]}))).unwrap();
    assert_eq!(
        score_tournament(&short).games[0].winner,
        Some(team("Alpha"))
    );
}

#[test]
fn impossible_games_are_refused() {
    for (changes, words) in [
        (
            json!({"away": "Alpha"}),
            ["Alpha against Alpha", "cannot play itself"],
        ),
        (json!({"round": 0}), ["round", "1 to 100, got 0"]),
        (json!({"round": 101}), ["round", "got 101"]),
        (json!({"round": -1}), ["[0].round", "invalid value"]),
        (json!({"round": 1.5}), ["[0].round", "1.5"]),
        (json!({"goals": [3]}), ["[0].goals", "length 1"]),
        (json!({"goals": [3, 2, 1]}), ["[0]", "trailing characters"]),
        (json!({"goals": [45_001, 0]}), ["goals", "45001"]),
        (json!({"fouls": [0, 45_001]}), ["fouls", "45001"]),
        (
            json!({"fouls": null}),
            ["Alpha against Beta", "fouls or score, got neither"],
        ),
        (
            json!({"score": [4, 3]}),
            ["score: expected [5, 3]", "got [4, 3]"],
        ),
        (
            json!({"fouls": null, "score": [2, 2]}),
            ["at least the goals [3, 2]", "got [2, 2]"],
        ),
        // At most 11 points in each of 90 windows.
        (
            json!({"penalty_points": [0, 990.5]}),
            ["penalty_points", "990.5"],
        ),
        (
            json!({"penalty_points": [-0.5, 0]}),
            ["penalty_points", "-0.5"],
        ),
        (json!({"windows": 0}), ["windows", "got 0"]),
        (json!({"home": "<b>"}), ["[0].home", "letters"]),
        (
            json!({"winner": "Alpha"}),
            ["[0]", "unknown field `winner`"],
        ),
        (json!({"goals": null}), ["[0]", "missing field `goals`"]),
    ] {
        let error = read::<Vec<PlayedGame>>(&game(changes)).unwrap_err();
        for word in words {
            assert!(error.contains(word), "{word:?} is not in: {error}");
        }
    }
}

/// The teams in the order of the standings.
fn standings(games: Value) -> Vec<String> {
    let games: Vec<PlayedGame> = read(&games.to_string()).unwrap();
    score_tournament(&games)
        .standings
        .iter()
        .map(|row| row.team.to_string())
        .collect()
}

#[test]
fn standings_sort_by_points_goals_penalty_and_name() {
    let game = |home: &str, away: &str, goals: [u32; 2], penalty_points: [f64; 2]| {
        json!({"round": 1, "home": home, "away": away, "goals": goals, "fouls": [0, 0],
               "penalty_points": penalty_points})
    };
    // Each of the first four teams beats a different opponent, a loser L1 to L4.
    assert_eq!(
        standings(json!([
            game("difference 1", "L1", [9, 8], [0.0, 0.0]),
            game("difference 2", "L2", [2, 0], [0.0, 0.0]),
            game("goals 3", "L3", [3, 1], [9.0, 0.0]),
            game("goals 3 clean", "L4", [3, 1], [8.0, 0.0]),
            game("Y", "X", [1, 1], [0.0, 0.0]),
        ])),
        // losers: difference −1, then −2 with 1, 1 and 0 goals
        [
            "goals 3 clean",
            "goals 3",
            "difference 2",
            "difference 1",
            "X",
            "Y",
            "L1",
            "L3",
            "L4",
            "L2"
        ]
    );
}

#[test]
fn repeated_pairing_counts_twice_and_is_reported() {
    let game = |round, home, away| {
        json!({"round": round, "home": home, "away": away, "goals": [1, 0], "fouls": [0, 0],
               "penalty_points": [0, 0]})
    };
    let games: Vec<PlayedGame> =
        read(&json!([game(1, "A", "B"), game(1, "B", "A"), game(2, "A", "B")]).to_string())
            .unwrap();
    let tournament = score_tournament(&games);
    assert_eq!(tournament.standings[0].points_per_round, [3, 3]);
    assert_eq!(tournament.repeated_pairings.len(), 1);
    let repeated = &tournament.repeated_pairings[0];
    assert_eq!((repeated.round, repeated.games), (1, 2));
    assert_eq!(repeated.teams, [team("A"), team("B")]);
}
