//! Test that the whole server reproduces the tournament of the original challenge: two rounds with 36 games give the tables of
//! the paper.

use super::{
    cup::{TestTournament, team_names},
    fake_worker::GameOutcome,
};
use crate::site::{ADMIN, string};
use faceoff_scoring::tournament::{PlayedGame, head_to_head, rating::rate, score_tournament};
use serde_json::{Value, json};

/// The games and tables of the paper.
const GOLDEN: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/tournament.json"
));

/// The outcome of these teams' game in the paper. The sides may be swapped by the draw.
fn paper_outcome(golden: &Value, round: u32, [home, away]: [&str; 2]) -> GameOutcome {
    let games = golden["games"].as_array().unwrap();
    let find = |a: &str, b: &str| {
        let mut games = games.iter();
        games.find(|game| game["round"] == round && game["home"] == a && game["away"] == b)
    };
    let number = |value: &Value| u32::try_from(value.as_u64().unwrap()).unwrap();
    let outcome = |game: &Value| {
        let pair_of = |field: &str| [number(&game[field][0]), number(&game[field][1])];
        let (goals, score) = (pair_of("goals"), pair_of("score"));
        GameOutcome {
            // The paper has goals and final score, but no fouls. The score includes a point for every third foul of the opponent.
            fouls: [3 * (score[1] - goals[1]), 3 * (score[0] - goals[0])],
            penalty_points: [0, 1].map(|side| game["penalty_points"][side].as_f64().unwrap()),
            ..GameOutcome::goals(goals[0], goals[1])
        }
    };
    match (find(home, away), find(away, home)) {
        (Some(game), _) => outcome(game),
        (None, Some(game)) => outcome(game).swapped(),
        (None, None) => panic!("{home} and {away} do not meet in round {round}"),
    }
}

#[tokio::test]
async fn tournament_of_the_paper_has_its_standings() {
    let golden: Value = serde_json::from_str(GOLDEN).unwrap();
    let teams_of_round_1 = [
        "AiRLIHockey",
        "GXU-LIPE",
        "SpaceR",
        "RL3_polimi",
        "AJoy",
        "Air-HocKIT",
    ];
    let mut cup = TestTournament::open(&teams_of_round_1, json!({})).await;
    let outcome = |game: &faceoff_store::Game, names: [&str; 2]| {
        let round = game.purpose.schedule_entry().unwrap().round;
        paper_outcome(&golden, round.get(), names)
    };
    assert_eq!(cup.view().await["phase"], "open");
    let first_round = cup.start_round().await;
    assert_eq!(
        (&first_round["progress"]["games"], &first_round["matchdays"]),
        (&json!(15), &json!(5))
    );
    assert_eq!(cup.view().await["phase"], "round");
    assert_eq!(cup.play(outcome).await, 15);
    assert_eq!(cup.view().await["phase"], "between");
    cup.add_team("CONFIRMTEAM").await;
    let entered = cup
        .post("entrants", json!({ "teams": ["CONFIRMTEAM"] }))
        .await;
    assert_eq!(entered.json(200)["entrants"].as_array().unwrap().len(), 7);
    let second_round = cup.start_round().await;
    assert_eq!(second_round["progress"]["games"], 21);
    assert_eq!(
        second_round["byes"].as_array().unwrap().len(),
        7,
        "with an odd number of teams each has a bye in the round"
    );
    assert_eq!(cup.play(outcome).await, 21);

    let view = cup.view().await;
    assert_eq!(
        (&view["phase"], &view["champion"]),
        (&json!("played"), &json!("AiRLIHockey"))
    );
    assert_eq!(view["tables"].as_array().unwrap().len(), 1);
    let standings = view["tables"][0]["standings"].as_array().unwrap();
    assert_eq!(standings.len(), 7);
    for (index, row) in standings.iter().enumerate() {
        let mut expected = json!({ "rank": index + 1 });
        for table in ["points", "aggregate"] {
            let columns = golden[table][index].as_object().unwrap().clone();
            expected.as_object_mut().unwrap().extend(columns);
        }
        assert_eq!(*row, expected);
    }

    let games = cup.games().await;
    assert_eq!(games.len(), 36);
    // Games that were won by a better tier, and those of them whose winner did not lead.
    let (mut won_by_tier, mut won_without_lead) = (0, 0);
    for game in &games {
        let (home, away) = team_names(game);
        let find_in_paper = |a: &str, b: &str| {
            let mut paper_games = golden["games"].as_array().unwrap().iter();
            paper_games.find(|paper_game| {
                paper_game["round"] == game["round"]
                    && paper_game["home"] == a
                    && paper_game["away"] == b
            })
        };
        let paper_game = find_in_paper(&home, &away)
            .or_else(|| find_in_paper(&away, &home))
            .unwrap();
        let result = &game["result"];
        assert_eq!(result["winner"], paper_game["winner"], "{game}");
        won_by_tier += u32::from(result["won_by"] == "tier");
        won_without_lead += u32::from(result["won_by"] == "tier" && result["winner_led"] == false);
        let says_not_led = string(&result["because"]).contains("did not lead");
        assert_eq!(says_not_led, result["winner_led"] == false);
    }
    assert_eq!((won_by_tier, won_without_lead), (19, 9));

    // `faceoff score tournament`, which scores a file of games, gives the same standings.
    let entries: Vec<PlayedGame> = games.iter().map(played_game).collect();
    let scored = score_tournament(&entries);
    assert_eq!(
        serde_json::to_value(&scored.standings).unwrap(),
        view["tables"][0]["standings"]
    );
    let get = async |resource: &str| {
        let path = format!("{}/{resource}", cup.path);
        cup.site.get(&path, None).await.json(200)
    };
    assert_eq!(
        get("head-to-head").await,
        serde_json::to_value(head_to_head(&entries)).unwrap()
    );
    let ratings = get("ratings").await;
    assert_eq!(
        ratings,
        serde_json::to_value(rate(&entries).unwrap()).unwrap()
    );
    assert_eq!(ratings, get("ratings").await, "ratings are deterministic");
    let best = &ratings["results"][0]["ratings"][0];
    assert_eq!(
        (&best["team"], &best["ci95"][1]),
        (&json!("AiRLIHockey"), &Value::Null)
    );
    let games_of_round_2 = cup
        .site
        .get(&format!("{}/games?round=2", cup.path), Some(ADMIN))
        .await
        .json(200);
    assert_eq!(games_of_round_2.as_array().unwrap().len(), 21);
}

/// A game as `faceoff score tournament` reads it.
fn played_game(game: &Value) -> PlayedGame {
    let (home, away) = team_names(game);
    let result = &game["result"];
    let entry = json!({
        "round": game["round"],
        "home": home,
        "away": away,
        "goals": result["goals"],
        "fouls": result["fouls"],
        "score": result["score"],
        "penalty_points": result["penalty_points"],
        "windows": result["windows"],
        "submissions": [game["sides"][0]["submission"], game["sides"][1]["submission"]],
    });
    serde_json::from_value(entry).unwrap()
}
