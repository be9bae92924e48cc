//! Tests of mirrored pairs (two games with the same seed and swapped sides), on synthetic pairs with known variances.

use crate::support::read;
use faceoff_scoring::tournament::{PlayedGame, find_mirrored_pairs};
use serde_json::{Value, json};

/// One of the two games of a mirrored pair.
fn half(home: &str, away: &str, goals: [u32; 2], pair: u32) -> Value {
    json!({"round": 1, "home": home, "away": away, "goals": goals, "fouls": [0, 0],
           "penalty_points": [0, 0], "pair": pair})
}

fn games(games: &[Value]) -> Vec<PlayedGame> {
    read(&json!(games).to_string()).unwrap()
}

/// Two games of A and B: A leads by `home` goals at home in the first, and by `away` goals away in the second.
fn pair(number: u32, [home, away]: [i32; 2]) -> [Value; 2] {
    let goals = |lead: i32| [lead.max(0).unsigned_abs(), (-lead).max(0).unsigned_abs()];
    let [a, b] = goals(away);
    [
        half("A", "B", goals(home), number),
        half("B", "A", [b, a], number),
    ]
}

/// Pairs with the given leads, numbered from 1.
fn pairs(leads: &[[i32; 2]]) -> Vec<Value> {
    (1..)
        .zip(leads)
        .flat_map(|(number, leads)| pair(number, *leads))
        .collect()
}

#[test]
fn opposite_luck_in_both_games_cancels() {
    // A leads by one goal of skill, and luck moves its lead by +3 in one game of the pair and by −3 in the other.
    let leads: Vec<_> = (0..20)
        .map(|n| if n % 2 == 0 { [4, -2] } else { [-2, 4] })
        .collect();
    let result = find_mirrored_pairs(&games(&pairs(&leads))).unwrap();
    let variances = result.variances.unwrap();
    assert_eq!(
        (result.pairs, variances.of_pairs, variances.ratio),
        (20, 0.0, Some(0.0))
    );
    // In each half the leads are ±3 around 1; the variance has the divisor n − 1 = 19.
    assert_eq!(variances.of_independent_games, 2.0 * 9.0 * 20.0 / 19.0);
    assert_eq!(variances.ratio_ci95, Some([0.0, 0.0]));
    let [pairing] = result.pairings.try_into().unwrap();
    assert_eq!(pairing.goal_difference.mean, 2.0);
    assert_eq!(pairing.goal_difference.mean_ci95, Some([2.0, 2.0]));
}

#[test]
fn equal_luck_in_both_games_doubles_variance() {
    let leads: Vec<_> = (0..20).map(|n| [n % 3, n % 3]).collect();
    let variances = find_mirrored_pairs(&games(&pairs(&leads)))
        .unwrap()
        .variances
        .unwrap();
    assert!((variances.ratio.unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn independent_games_of_a_pair_have_ratio_one() {
    // Each combination of both halves' results is equally frequent, so the covariance is 0.
    let leads: Vec<_> = (0..50).map(|n| [n % 5 - 2, n / 5 % 5 - 2]).collect();
    let mut games_of_pairs = pairs(&leads);
    let result = find_mirrored_pairs(&games(&games_of_pairs)).unwrap();
    let variances = result.variances.clone().unwrap();
    assert!((variances.ratio.unwrap() - 1.0).abs() < 1e-12);
    let [low, high] = variances.ratio_ci95.unwrap();
    assert!(
        (0.6..0.9).contains(&low) && (1.1..1.4).contains(&high),
        "{low} {high}"
    );
    // The same pairs in another order, and the second half first.
    games_of_pairs.reverse();
    assert_eq!(
        find_mirrored_pairs(&games(&games_of_pairs)).unwrap(),
        result
    );
}

#[test]
fn variances_are_pooled_and_single_games_ignored() {
    // C loses by 9 and by 11 alternately, in both halves; the difference between the pairings is not variance.
    let mut all = pairs(&[[1, 1], [1, 1], [1, 1]]);
    for (pair, goals) in (10..).zip([9, 11, 9, 11]) {
        all.push(half("A", "C", [goals, 0], pair));
        all.push(half("C", "A", [0, goals], pair));
    }
    let expected = find_mirrored_pairs(&games(&all)).unwrap();
    let variances = expected.variances.clone().unwrap();
    // Three equal pairs of A and B, four of A and C: 2 + 3 = 5 degrees of freedom. The sums of the four pairs are ±2 around 20,
    // their halves ±1 around 10.
    assert_eq!(variances.of_pairs, 16.0 / 5.0);
    assert_eq!(variances.of_independent_games, 8.0 / 5.0);
    assert_eq!(variances.ratio_ci95, None, "seven pairs");
    let means: Vec<_> = expected
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
    // Half a pair whose other game failed by a platform fault, and a single game.
    all.push(half("A", "B", [90, 0], 99));
    let mut single = half("A", "B", [90, 0], 0);
    single.as_object_mut().unwrap().remove("pair");
    all.push(single);
    assert_eq!(find_mirrored_pairs(&games(&all)).unwrap(), expected);
    assert_eq!(find_mirrored_pairs(&[]).unwrap().variances, None);
}

#[test]
fn pair_without_swapped_sides_is_refused() {
    let error = find_mirrored_pairs(&games(&[
        half("A", "B", [1, 0], 3),
        half("A", "B", [1, 0], 3),
    ]))
    .unwrap_err();
    assert!(error.to_string().contains("with sides swapped"), "{error}");
}
