//! What mirrored pairs are worth, on made pairs whose variances are known.

use crate::support::read;
use faceoff_scoring::tournament::{PlayedGame, mirrored};
use serde_json::{Value, json};

fn half(home: &str, away: &str, goals: [u32; 2], pair: u32) -> Value {
    json!({"round": 1, "home": home, "away": away, "goals": goals, "fouls": [0, 0],
           "penalty_points": [0, 0], "pair": pair})
}

fn games(games: &[Value]) -> Vec<PlayedGame> {
    read(&json!(games).to_string()).unwrap()
}

/// A meets B; the first game ends `one` goals for A who is at home, the second `other` goals for A who is away.
fn pair(number: u32, [one, other]: [i32; 2]) -> [Value; 2] {
    let goals = |ahead: i32| [ahead.max(0).unsigned_abs(), (-ahead).max(0).unsigned_abs()];
    let [a, b] = goals(other);
    [
        half("A", "B", goals(one), number),
        half("B", "A", [b, a], number),
    ]
}

fn pairs(all: &[[i32; 2]]) -> Vec<Value> {
    (1..)
        .zip(all)
        .flat_map(|(n, halves)| pair(n, *halves))
        .collect()
}

#[test]
fn what_luck_gives_in_one_half_and_takes_in_the_other_cancels() {
    // Luck of ±3 that goes to whoever is at home, on top of one goal of skill.
    let all: Vec<_> = (0..20)
        .map(|n| if n % 2 == 0 { [4, -2] } else { [-2, 4] })
        .collect();
    let told = mirrored(&games(&pairs(&all))).unwrap();
    let spread = told.spread.unwrap();
    assert_eq!(
        (told.pairs, spread.of_pairs, spread.ratio),
        (20, 0.0, Some(0.0))
    );
    // Each half: ±3 around 1, by n − 1.
    assert_eq!(spread.of_independent_games, 2.0 * 9.0 * 20.0 / 19.0);
    assert_eq!(spread.ratio_ci95, Some([0.0, 0.0]));
    let [pairing] = told.pairings.try_into().unwrap();
    assert_eq!(pairing.goal_difference.mean, 2.0);
    assert_eq!(pairing.goal_difference.mean_ci95, Some([2.0, 2.0]));
}

#[test]
fn what_goes_with_the_seed_for_one_side_counts_twice() {
    let all: Vec<_> = (0..20).map(|n| [n % 3, n % 3]).collect();
    let spread = mirrored(&games(&pairs(&all))).unwrap().spread.unwrap();
    assert!((spread.ratio.unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn halves_that_know_nothing_of_each_other_have_a_ratio_of_one() {
    // Every combination of both halves' outcomes as often: no covariance at all.
    let all: Vec<_> = (0..50).map(|n| [n % 5 - 2, n / 5 % 5 - 2]).collect();
    let mut listed = pairs(&all);
    let told = mirrored(&games(&listed)).unwrap();
    let spread = told.spread.clone().unwrap();
    assert!((spread.ratio.unwrap() - 1.0).abs() < 1e-12);
    let [low, high] = spread.ratio_ci95.unwrap();
    assert!(
        (0.6..0.9).contains(&low) && (1.1..1.4).contains(&high),
        "{low} {high}"
    );
    // The same pairs in another order, and the second half first.
    listed.reverse();
    assert_eq!(mirrored(&games(&listed)).unwrap(), told);
}

#[test]
fn pairings_are_pooled_around_their_own_means_and_single_games_say_nothing() {
    // C loses by 9 and by 11 in turn, both halves alike; the difference between the pairings is no luck.
    let mut all = pairs(&[[1, 1], [1, 1], [1, 1]]);
    for (pair, goals) in (10..).zip([9, 11, 9, 11]) {
        all.push(half("A", "C", [goals, 0], pair));
        all.push(half("C", "A", [0, goals], pair));
    }
    let before = mirrored(&games(&all)).unwrap();
    let spread = before.spread.clone().unwrap();
    // Five degrees of freedom; of the four pairs' sums ±2 around 20, of each half ±1 around 10.
    assert_eq!(spread.of_pairs, 16.0 / 5.0);
    assert_eq!(spread.of_independent_games, 8.0 / 5.0);
    assert_eq!(spread.ratio_ci95, None, "seven pairs");
    let means: Vec<_> = before
        .pairings
        .iter()
        .map(|pairing| {
            (
                pairing.submissions[1].team.as_str(),
                pairing.goal_difference.mean,
            )
        })
        .collect();
    assert_eq!(means, [("B", 2.0), ("C", 20.0)]);
    // A half whose other one was ours to break, and a game that never was one of a pair.
    all.push(half("A", "B", [90, 0], 99));
    let mut single = half("A", "B", [90, 0], 0);
    single.as_object_mut().unwrap().remove("pair");
    all.push(single);
    assert_eq!(mirrored(&games(&all)).unwrap(), before);
    assert_eq!(mirrored(&[]).unwrap().spread, None);
}

#[test]
fn games_of_one_side_alone_are_no_pair() {
    let error = mirrored(&games(&[
        half("A", "B", [1, 0], 3),
        half("A", "B", [1, 0], 3),
    ]))
    .unwrap_err();
    assert!(error.to_string().contains("with sides swapped"), "{error}");
}
