use crate::support::{read, rows};
use faceoff_scoring::tournament::{PlayedGame, score_tournament};
use serde_json::{Value, json};

const GOLDEN: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/tournament.json"
));

fn golden() -> Value {
    serde_json::from_str(GOLDEN).unwrap()
}

fn games(golden: &Value) -> Vec<PlayedGame> {
    let mut games = golden["games"].clone();
    for game in games.as_array_mut().unwrap() {
        game.as_object_mut().unwrap().remove("winner");
    }
    read(&games.to_string()).unwrap()
}

#[test]
fn all_36_games_have_the_winner_of_the_paper() {
    let golden = golden();
    let tournament = score_tournament(&games(&golden));
    let expected = rows(&golden, "games");
    assert_eq!((tournament.games.len(), expected.len()), (36, 36));
    for (game, expected) in tournament.games.iter().zip(expected) {
        // Every field of the entry, and the winner.
        assert_eq!(serde_json::to_value(game).unwrap(), *expected);
    }
    assert_eq!(tournament.repeated_pairings, []);
}

#[test]
fn the_standings_are_those_of_the_paper() {
    let golden = golden();
    let tournament = score_tournament(&games(&golden));
    let (points, aggregate) = (rows(&golden, "points"), rows(&golden, "aggregate"));
    assert_eq!(
        (tournament.standings.len(), points.len(), aggregate.len()),
        (7, 7, 7)
    );
    for (place, standing) in tournament.standings.iter().enumerate() {
        let mut expected = json!({"rank": place + 1});
        for table in [&points[place], &aggregate[place]] {
            expected
                .as_object_mut()
                .unwrap()
                .extend(table.as_object().unwrap().clone());
        }
        assert_eq!(serde_json::to_value(standing).unwrap(), expected);
    }
}

#[test]
fn one_round_alone_gives_its_points() {
    let golden = golden();
    let second: Vec<_> = games(&golden)
        .into_iter()
        .filter(|game| game.round() == 2)
        .collect();
    for standing in score_tournament(&second).standings {
        let expected = rows(&golden, "points")
            .iter()
            .find(|row| row["team"] == standing.team.as_str())
            .unwrap();
        assert_eq!(standing.points_per_round[0], 0);
        assert_eq!(
            json!(standing.points_per_round[1]),
            expected["points_per_round"][1]
        );
    }
}
