//! Compares results and standings with the tournament tables of the paper on the competition of 2023, whose rules these are.

use crate::support::{read, rows};
use faceoff_scoring::tournament::{
    DrawReason, GameResult, PlayedGame, WinReason, score_tournament,
};
use serde_json::{Value, json};

/// The tables of the paper.
const GOLDEN: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/tournament.json"
));

fn golden() -> Value {
    serde_json::from_str(GOLDEN).unwrap()
}

/// The games of the paper without their winners.
fn games(golden: &Value) -> Vec<PlayedGame> {
    let mut games = golden["games"].clone();
    for game in games.as_array_mut().unwrap() {
        game.as_object_mut().unwrap().remove("winner");
    }
    read(&games.to_string()).unwrap()
}

#[test]
fn winners_of_all_36_games_are_those_of_the_paper() {
    let golden = golden();
    let tournament = score_tournament(&games(&golden));
    let expected = rows(&golden, "games");
    assert_eq!((tournament.games.len(), expected.len()), (36, 36));
    for (game, expected) in tournament.games.iter().zip(expected) {
        // Compare all fields of the entry and the winner; the tables of the paper have no reasons.
        let mut game = serde_json::to_value(game).unwrap();
        for reason in ["won_by", "winner_led", "drawn_by"] {
            game.as_object_mut().unwrap().remove(reason);
        }
        assert_eq!(game, *expected);
    }
    assert_eq!(tournament.repeated_pairings, []);
}

/// The 19 games that the tier decided, by round and teams, with whether the winner led.
const BY_TIER: [(u32, &str, &str, bool); 19] = [
    (1, "AiRLIHockey", "GXU-LIPE", true),
    (1, "AiRLIHockey", "SpaceR", true),
    (1, "AiRLIHockey", "RL3_polimi", true),
    (1, "AiRLIHockey", "Air-HocKIT", true),
    (1, "RL3_polimi", "AJoy", false),
    (1, "RL3_polimi", "SpaceR", true),
    (1, "Air-HocKIT", "AJoy", false),
    (1, "SpaceR", "GXU-LIPE", true),
    (1, "AJoy", "GXU-LIPE", false),
    (2, "GXU-LIPE", "AiRLIHockey", true),
    (2, "CONFIRMTEAM", "AiRLIHockey", true),
    (2, "GXU-LIPE", "RL3_polimi", false),
    (2, "CONFIRMTEAM", "RL3_polimi", false),
    (2, "GXU-LIPE", "Air-HocKIT", true),
    (2, "CONFIRMTEAM", "Air-HocKIT", true),
    (2, "GXU-LIPE", "SpaceR", false),
    (2, "CONFIRMTEAM", "SpaceR", false),
    (2, "CONFIRMTEAM", "AJoy", false),
    (2, "GXU-LIPE", "AJoy", false),
];

#[test]
fn tier_decided_19_games_and_9_winners_did_not_lead() {
    let games = games(&golden());
    let mut by_tier = Vec::new();
    // Numbers of games that were won by score and that were drawn.
    let mut others = [0; 2];
    for game in &games {
        let [home, away] = game.teams().map(|team| team.as_str());
        match game.result() {
            GameResult::Won {
                reason: WinReason::Tier { had_higher_score },
                ..
            } => by_tier.push((game.round(), home, away, had_higher_score)),
            GameResult::Won {
                reason: WinReason::Score,
                ..
            } => others[0] += 1,
            GameResult::Drawn(DrawReason::BothNonDeployable) => others[1] += 1,
            other => panic!("{home} against {away}: {other:?}"),
        }
    }
    assert_eq!(by_tier, BY_TIER);
    assert_eq!(
        by_tier
            .iter()
            .filter(|(.., had_higher_score)| !had_higher_score)
            .count(),
        9
    );
    assert_eq!(
        others,
        [13, 4],
        "by score, and drawn since both were unsafe"
    );
}

#[test]
fn result_reason_is_in_json_and_in_words() {
    let games = games(&golden());
    let reason_of = |home: &str, away: &str| {
        let game = games
            .iter()
            .find(|game| game.teams().map(|team| team.as_str()) == [home, away])
            .unwrap();
        let json = serde_json::to_value(game.scored(None)).unwrap();
        let fields = ["won_by", "winner_led", "drawn_by"].map(|field| json[field].clone());
        (Value::from(fields.to_vec()), game.result().to_string())
    };
    for (teams, fields, words) in [
        (
            ["AiRLIHockey", "AJoy"],
            json!(["score", true, null]),
            "higher score",
        ),
        (
            ["AiRLIHockey", "SpaceR"],
            json!(["tier", true, null]),
            "the other side is non-deployable",
        ),
        (
            ["Air-HocKIT", "AJoy"],
            json!(["tier", false, null]),
            "the other side is non-deployable; the winner did not lead",
        ),
        (
            ["CONFIRMTEAM", "GXU-LIPE"],
            json!([null, null, "both_non_deployable"]),
            "both are non-deployable",
        ),
    ] {
        assert_eq!(reason_of(teams[0], teams[1]), (fields, words.to_owned()));
    }
}

#[test]
fn standings_are_those_of_the_paper() {
    let golden = golden();
    let tournament = score_tournament(&games(&golden));
    let (points, aggregate) = (rows(&golden, "points"), rows(&golden, "aggregate"));
    assert_eq!(
        (tournament.standings.len(), points.len(), aggregate.len()),
        (7, 7, 7)
    );
    for (index, row) in tournament.standings.iter().enumerate() {
        let mut expected = json!({"rank": index + 1});
        for table in [&points[index], &aggregate[index]] {
            expected
                .as_object_mut()
                .unwrap()
                .extend(table.as_object().unwrap().clone());
        }
        assert_eq!(serde_json::to_value(row).unwrap(), expected);
    }
}

#[test]
fn single_round_gives_its_points() {
    let golden = golden();
    let second_round: Vec<_> = games(&golden)
        .into_iter()
        .filter(|game| game.round() == 2)
        .collect();
    for row in score_tournament(&second_round).standings {
        let expected = rows(&golden, "points")
            .iter()
            .find(|expected| expected["team"] == row.team.as_str())
            .unwrap();
        assert_eq!(row.points_per_round[0], 0);
        assert_eq!(
            json!(row.points_per_round[1]),
            expected["points_per_round"][1]
        );
    }
}
