//! Tests of tournament formats: round robin with byes (a team without an opponent on a matchday), groups with a final, Swiss
//! (each round pairs neighbours of the standings), and mirrored pairs (two games with the same seed and swapped sides).

use super::{
    cup::{TestTournament, first_by_name_wins, team_names},
    fake_worker::GameOutcome,
};
use crate::site::{ADMIN, Site, result, string};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Home and away team of each game of this round.
fn meetings(games: &[Value], round: u32) -> BTreeSet<(String, String)> {
    let round_games = games.iter().filter(|game| game["round"] == round);
    round_games.map(team_names).collect()
}

fn with_swapped_sides(pairs: &BTreeSet<(String, String)>) -> BTreeSet<(String, String)> {
    let pairs = pairs.iter().cloned();
    pairs.map(|(home, away)| (away, home)).collect()
}

#[tokio::test]
async fn double_round_robin_has_byes_and_swaps_sides() {
    let names = ["A", "B", "C", "D", "E"];
    let cup = TestTournament::open(&names, json!({})).await;
    for round in 1..=2 {
        let started = cup.start_round().await;
        let byes = started["byes"].as_array().unwrap();
        let with_bye: BTreeSet<String> = byes.iter().map(|bye| string(&bye["team_name"])).collect();
        assert_eq!(with_bye, names.map(str::to_owned).into());
        assert_eq!(started["number"], round);
        // Games are played in the order of matchdays.
        let mut last_matchday = 0;
        while let Some(game) = cup.play_next(first_by_name_wins).await {
            let matchday = game.purpose.schedule_entry().unwrap().matchday;
            assert!(
                matchday >= last_matchday,
                "{matchday} after {last_matchday}"
            );
            last_matchday = matchday;
        }
        assert_eq!(last_matchday, 5);
    }
    let games = cup.games().await;
    assert_eq!(games.len(), 20);
    let (first, second) = (meetings(&games, 1), meetings(&games, 2));
    assert_eq!(first.len(), 10);
    assert_eq!(second, with_swapped_sides(&first));
    let view = cup.view().await;
    let standings = view["tables"][0]["standings"].as_array().unwrap();
    let points: Vec<&Value> = standings
        .iter()
        .map(|row| &row["points_per_round"])
        .collect();
    assert_eq!(
        points,
        [
            &json!([12, 12]),
            &json!([9, 9]),
            &json!([6, 6]),
            &json!([3, 3]),
            &json!([0, 0])
        ]
    );
    cup.post("rounds", json!({}))
        .await
        .problem(409, "conflict", &["all 2 rounds", "close it"]);
}

#[tokio::test]
async fn game_shows_its_seed_label_but_not_the_seed() {
    let cup = TestTournament::open(&["A", "B", "C", "D"], json!({})).await;
    cup.start_round().await;
    let games = cup.games().await;
    let labels: Vec<String> = games
        .iter()
        .map(|game| string(&game["seed_label"]))
        .collect();
    assert_eq!(labels[0], "tournament/1/round/1/meeting/1");
    let distinct: BTreeSet<&String> = labels.iter().collect();
    assert_eq!(distinct.len(), 6);
    cup.play(first_by_name_wins).await;
    let path = format!("{}/games", cup.path);
    let organiser_list = cup.site.get(&path, Some(ADMIN)).await.json(200);
    let team_list = cup.site.get(&path, Some(cup.token("A"))).await.body;
    for game in organiser_list.as_array().unwrap() {
        let seed = string(&game["result"]["recording"]["seed"]);
        assert!(!team_list.contains(&seed), "{seed} is in {team_list}");
    }
}

#[tokio::test]
async fn groups_send_their_best_to_a_final() {
    let names = ["A", "B", "C", "D", "E", "F"];
    let format = json!({ "kind": "groups", "groups": 2, "advance": 1 });
    let cup = TestTournament::open(&names, json!({ "rules": { "format": format } })).await;
    let started = cup.start_round().await;
    let groups = started["groups"].as_array().unwrap().clone();
    assert_eq!(
        groups
            .iter()
            .map(|group| group.as_array().unwrap().len())
            .collect::<Vec<_>>(),
        [3, 3]
    );
    assert_eq!(cup.play(first_by_name_wins).await, 6);
    let best_of = |group: &Value| {
        let names = group.as_array().unwrap().iter();
        names.map(string).min().unwrap()
    };
    let finalists: BTreeSet<String> = groups.iter().map(best_of).collect();
    let final_round = cup.start_round().await;
    let entrants_of_final: BTreeSet<String> = final_round["submissions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|submission| string(&submission["team_name"]))
        .collect();
    assert_eq!(entrants_of_final, finalists);
    let last_by_name_wins =
        |game: &faceoff_store::Game, names: [&str; 2]| first_by_name_wins(game, names).swapped();
    assert_eq!(cup.play(last_by_name_wins).await, 1);
    let view = cup.view().await;
    let table_scopes: Vec<&Value> = view["tables"]
        .as_array()
        .unwrap()
        .iter()
        .map(|table| &table["of"])
        .collect();
    assert_eq!(
        table_scopes,
        [&json!("final"), &json!({"group": 1}), &json!({"group": 2})]
    );
    assert_eq!(view["champion"], json!(finalists.last().unwrap()));
    cup.post("entrants", json!({ "teams": ["A"] }))
        .await
        .problem(409, "conflict", &["groups are drawn"]);
}

#[tokio::test]
async fn swiss_pairs_neighbours_and_gives_points_for_a_bye() {
    let names = ["A", "B", "C", "D", "E"];
    let format = json!({ "kind": "swiss", "rounds": 3 });
    let cup = TestTournament::open(&names, json!({ "rules": { "format": format } })).await;
    let mut meetings = BTreeMap::<BTreeSet<String>, u32>::new();
    for _ in 0..3 {
        let started = cup.start_round().await;
        assert_eq!(started["progress"]["games"], 2);
        assert_eq!(started["byes"].as_array().unwrap().len(), 1);
        cup.play(first_by_name_wins).await;
    }
    for game in cup.games().await {
        let (home, away) = team_names(&game);
        *meetings.entry([home, away].into()).or_default() += 1;
    }
    assert!(meetings.values().all(|times| *times == 1), "{meetings:?}");
    let view = cup.view().await;
    let standings = view["tables"][0]["standings"].as_array().unwrap();
    let byes: u64 = standings
        .iter()
        .map(|row| row["byes"].as_u64().unwrap_or(0))
        .sum();
    assert_eq!(byes, 3);
    let points: u64 = standings
        .iter()
        .map(|row| row["points"].as_u64().unwrap())
        .sum();
    assert_eq!(points, 3 * (2 * 3 + 3), "three for each win and each bye");
    // A wins all its games. But another team with a bye may have as many points, and may not meet A, since other teams would
    // then meet twice. Goals decide between the two, so the champion is not always A.
    let row_of = |team: &str| standings.iter().find(|row| row["team"] == team).unwrap();
    assert_eq!(row_of("A")["points"], 9);
    assert_eq!(standings[0]["points"], 9);
    assert_eq!(view["champion"], standings[0]["team"]);
}

#[tokio::test]
async fn mirrored_meeting_is_two_games_with_the_same_seed() {
    let rules = json!({ "mirrored": true, "format": { "kind": "round_robin", "rounds": 1 } });
    let cup = TestTournament::open(&["A", "B", "C"], json!({ "rules": rules })).await;
    cup.start_round().await;
    let first_game = cup.play_next(first_by_name_wins).await.unwrap();
    assert_eq!(cup.play(first_by_name_wins).await, 5);
    let games = cup.games().await;
    for pair in games.chunks(2) {
        assert_eq!(pair[0]["seed_label"], pair[1]["seed_label"]);
        assert_eq!(pair[0]["meeting"], pair[1]["meeting"]);
        assert_eq!(
            [&pair[0]["second_half"], &pair[1]["second_half"]],
            [false, true]
        );
        let (home, away) = team_names(&pair[0]);
        assert_eq!(team_names(&pair[1]), (away, home));
    }
    assert_eq!(first_game.purpose.schedule_entry().unwrap().pairing, 1);
    let standings = cup.view().await["tables"][0]["standings"].clone();
    assert_eq!(standings[0]["points"], 12, "each game of a pair counts");
    let ratings = cup
        .site
        .get(&format!("{}/ratings", cup.path), None)
        .await
        .json(200);
    assert_eq!(
        ratings["results"][0]["units"], 3,
        "a mirrored pair counts as one observation"
    );
}

#[tokio::test]
async fn default_entrants_are_ranked_and_deployable_or_improvable() {
    let site = Site::start().await;
    site.add_ranked_teams(&[
        ("Deployable", result([0.5; 3], 10.0)),
        ("Improvable", result([0.5; 3], 900.0)),
        ("Unsafe", result([0.9; 3], 2000.0)),
    ])
    .await;
    site.team("Without").await;
    for (name, body) in [
        ("By default", json!({})),
        ("By name", json!({ "stage": "qualifying" })),
        ("By id", json!({ "stage": site.stage().await })),
    ] {
        let mut body = body;
        body["name"] = json!(name);
        let opened = site
            .post("/api/v1/tournaments", Some(ADMIN), &body)
            .await
            .json(201);
        let names: Vec<String> = opened["entrants"]
            .as_array()
            .unwrap()
            .iter()
            .map(|entrant| string(&entrant["team_name"]))
            .collect();
        assert_eq!(names, ["Deployable", "Improvable"]);
        assert_eq!(opened["stage"], json!(site.stage().await));
    }
    let list = site.get("/api/v1/tournaments", None).await.json(200);
    let numbers: Vec<&Value> = list
        .as_array()
        .unwrap()
        .iter()
        .map(|tournament| &tournament["number"])
        .collect();
    assert_eq!(numbers, [&json!(1), &json!(2), &json!(3)]);
}

#[tokio::test]
async fn team_without_valid_submission_blocks_the_round() {
    let mut cup = TestTournament::open(&["A", "B"], json!({})).await;
    let late = cup.site.team("Late").await;
    cup.teams.insert("Late".to_owned(), late);
    cup.post("entrants", json!({ "teams": ["late"] }))
        .await
        .json(200);
    cup.post("rounds", json!({}))
        .await
        .problem(409, "conflict", &["Late", "Wait for them"]);
    assert_eq!(cup.view().await["phase"], "open", "nothing was done");
    // The round can start after the team is withdrawn.
    let departure =
        json!({ "team": "Late", "as": "withdrawn", "reason": "no agent", "confirm": "Late" });
    let view = cup.post("departures", departure).await.json(200);
    assert_eq!(view["entrants"].as_array().unwrap().len(), 2);
    cup.start_round().await;
    assert_eq!(cup.play(|_, _| GameOutcome::goals(1, 1)).await, 1);
}

#[tokio::test]
async fn concurrent_round_starts_create_one_round() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    let (first, second) =
        tokio::join!(cup.post("rounds", json!({})), cup.post("rounds", json!({})));
    let mut statuses = [first.status.as_u16(), second.status.as_u16()];
    statuses.sort_unstable();
    assert_eq!(statuses, [201, 409], "{} {}", first.body, second.body);
    let refused = if first.status == 409 { first } else { second };
    refused.problem(409, "conflict", &[]);
    assert_eq!(cup.games().await.len(), 3);
    cup.post("rounds", json!({})).await.problem(
        409,
        "conflict",
        &["round 1 is running: 3 of its games"],
    );
}
