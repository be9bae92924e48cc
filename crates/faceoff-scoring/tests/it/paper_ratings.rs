//! Compares ratings from the 36 games of the paper on the competition of 2023 with expected ones. The expected estimates are
//! from an independent program that minimises the negative logarithm of the posterior with SciPy's BFGS, the expected
//! intervals from its bootstrap with NumPy's random numbers.

use crate::support::read;
use faceoff_scoring::tournament::{
    PlayedGame,
    rating::{Pool, rate},
};
use serde_json::{Value, json};

/// The games without their winners, changed by `edit`.
fn games(edit: impl Fn(&mut Value)) -> Vec<PlayedGame> {
    let golden: Value = serde_json::from_str(include_str!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/golden/tournament.json"
    )))
    .unwrap();
    let mut games = golden["games"].clone();
    for game in games.as_array_mut().unwrap() {
        game.as_object_mut().unwrap().remove("winner");
        edit(game);
    }
    read(&games.to_string()).unwrap()
}

/// Team, rating, and bounds of the independent program's interval; `None` if the interval has no such bound.
type Expected = (&'static str, f64, Option<f64>, Option<f64>);

#[track_caller]
fn assert_ratings(pool: &Pool, expected: &[Expected]) {
    assert_eq!(pool.ratings.len(), expected.len());
    for (row, (team, rating, low, high)) in pool.ratings.iter().zip(expected) {
        assert_eq!(row.rated.team.as_str(), *team);
        assert!((row.rating - rating).abs() < 1e-3, "{team}: {}", row.rating);
        for (got, reference) in row.ci95.into_iter().zip([low, high]) {
            assert_eq!(got.is_some(), reference.is_some(), "{team}: {:?}", row.ci95);
            if let (Some(got), Some(reference)) = (got, reference) {
                // Two bootstraps with a thousand samples may differ by this much.
                assert!(
                    (got - reference).abs() < 30.0,
                    "{team}: {got}, expected {reference}"
                );
            }
        }
    }
}

#[test]
fn ratings_of_the_papers_teams_are_as_expected() {
    let ratings = rate(&games(|_| ())).unwrap();
    let [results] = ratings.results.as_slice() else {
        panic!("all teams are connected: {:?}", ratings.results);
    };
    assert_eq!(results.units, 36);
    assert_ratings(
        results,
        &[
            ("AiRLIHockey", 1973.2164, Some(1864.4), None), // won all of its games
            ("Air-HocKIT", 1613.2622, Some(1413.5), Some(1816.4)),
            ("SpaceR", 1613.2622, Some(1468.8), Some(1793.6)),
            ("AJoy", 1479.1440, Some(1289.9), Some(1670.4)),
            ("RL3_polimi", 1412.6608, Some(1241.3), Some(1571.3)),
            ("GXU-LIPE", 1228.3078, Some(1087.0), Some(1358.6)),
            ("CONFIRMTEAM", 1180.1465, Some(1074.5), Some(1328.4)),
        ],
    );
    let [goals] = ratings.goals.as_slice() else {
        panic!("all teams are connected: {:?}", ratings.goals);
    };
    assert_ratings(
        goals,
        &[
            ("AiRLIHockey", 2050.3924, Some(1902.8), Some(2208.7)),
            ("Air-HocKIT", 1715.9678, Some(1624.9), Some(1813.9)),
            ("CONFIRMTEAM", 1570.7393, Some(1424.8), Some(1781.6)),
            ("GXU-LIPE", 1503.3330, Some(1355.4), Some(1636.3)),
            ("SpaceR", 1464.0604, Some(1349.7), Some(1596.6)),
            ("RL3_polimi", 1221.1271, Some(1029.7), Some(1376.0)),
            ("AJoy", 974.3801, Some(800.4), Some(1102.9)),
        ],
    );
    let game_counts: Vec<_> = results.ratings.iter().map(|row| row.games).collect();
    assert_eq!(game_counts, [11, 11, 11, 11, 11, 11, 6]);
}

/// Teams changed their agents between the rounds, so submissions of the first round never met those of the second.
#[test]
fn submissions_of_the_papers_rounds_are_two_pools() {
    let ratings = rate(&games(|game| {
        let label = format!("round-{}", game["round"]);
        game["submissions"] = json!([label, label]);
    }))
    .unwrap();
    let rounded = |pool: &Pool| -> Vec<(String, f64)> {
        let row = |row: &faceoff_scoring::tournament::rating::Rating| {
            let label = row.rated.submission.as_ref().unwrap();
            let rating = (row.rating * 10.0).round() / 10.0;
            (format!("{} {label}", row.rated.team), rating)
        };
        pool.ratings.iter().map(row).collect()
    };
    let [first, second] = ratings.results.as_slice() else {
        panic!("{:?}", ratings.results);
    };
    assert_eq!((first.units, second.units), (15, 21));
    let named = |rows: &[(&str, f64)]| -> Vec<(String, f64)> {
        rows.iter()
            .map(|(name, rating)| ((*name).to_owned(), *rating))
            .collect()
    };
    assert_eq!(
        rounded(first),
        named(&[
            ("AiRLIHockey round-1", 1844.0),
            ("AJoy round-1", 1552.2),
            ("SpaceR round-1", 1552.2),
            ("Air-HocKIT round-1", 1432.7),
            ("GXU-LIPE round-1", 1309.4),
            ("RL3_polimi round-1", 1309.4),
        ])
    );
    assert_eq!(
        rounded(second),
        named(&[
            ("AiRLIHockey round-2", 1917.5),
            ("Air-HocKIT round-2", 1759.5),
            ("SpaceR round-2", 1624.2),
            ("RL3_polimi round-2", 1497.2),
            ("AJoy round-2", 1370.9),
            ("CONFIRMTEAM round-2", 1165.3),
            ("GXU-LIPE round-2", 1165.3),
        ])
    );
}
