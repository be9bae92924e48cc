//! Tests of boards, which rank evaluations, and of their groups of statistically tied rows.

use crate::support::{bounds, task_result, weights};
use faceoff_airhockey::{DEFEND, EVALUATION, HIT};
use faceoff_scoring::{
    BoardEntry, RankedEntry, overall_board, rank_groups, score_evaluation, task_board,
};
use faceoff_types::{Seed, TaskMap, Tier};
use proptest::prelude::*;
use std::convert::Infallible;

/// An entry with 50 episodes of the task hit only. Up to 25 penalty points it is deployable, up to 75 improvable.
fn entry<K>(key: K, successes: u32, penalty_points: f64, submitted_at_ms: i64) -> BoardEntry<K> {
    let tasks = TaskMap::from([(HIT, task_result(50, successes, penalty_points))]);
    let result = score_evaluation(
        faceoff_airhockey::RULESET,
        EVALUATION,
        Seed::from_number(0),
        &Default::default(),
        &weights(),
        bounds(),
        tasks,
    );
    BoardEntry {
        key,
        result,
        submitted_at_ms,
    }
}

fn keys<K: Copy>(board: &[RankedEntry<K>]) -> Vec<K> {
    board.iter().map(|row| row.entry.key).collect()
}

#[test]
fn board_sorts_by_tier_score_penalty_and_submission_time() {
    let entries = vec![
        entry("unsafe and best", 50, 80.0, 0),
        entry("later", 20, 5.0, 2),
        entry("earlier", 20, 5.0, 1),
        entry("cleaner", 20, 4.5, 3),
        entry("better", 21, 25.0, 4),
        entry("improvable", 49, 25.5, 0),
    ];
    let board = overall_board(entries.clone());
    let expected = [
        "better",
        "cleaner",
        "earlier",
        "later",
        "improvable",
        "unsafe and best",
    ];
    assert_eq!(keys(&board), expected);
    assert_eq!(
        board.iter().map(|row| row.rank).collect::<Vec<_>>(),
        [1, 2, 3, 4, 5, 6]
    );
    assert_eq!(board[4].tier, Some(Tier::Improvable));
    assert_eq!(keys(&task_board(HIT, entries.clone())), expected);
    assert_eq!(task_board(DEFEND, entries), []);
    assert_eq!(overall_board(Vec::<BoardEntry<u8>>::new()), []);
}

/// The entry of a competition without tiers.
fn without_tier<K>(mut entry: BoardEntry<K>) -> BoardEntry<K> {
    entry.result.tier = None;
    for task in entry.result.tasks.values_mut() {
        task.tier = None;
    }
    entry
}

#[test]
fn board_without_tiers_sorts_by_score_and_penalty() {
    let entries = vec![
        without_tier(entry("later", 20, 5.0, 2)),
        without_tier(entry("earlier", 20, 5.0, 1)),
        without_tier(entry("best", 50, 80.0, 0)),
        without_tier(entry("cleaner", 20, 4.5, 3)),
    ];
    let expected = ["best", "cleaner", "earlier", "later"];
    let board = overall_board(entries.clone());
    assert_eq!(keys(&board), expected);
    assert_eq!(board[0].tier, None);
    assert_eq!(keys(&task_board(HIT, entries)), expected);
    // Penalty points divide no rank groups.
    let groups = rank_groups(&board, |_, _| Ok::<_, Infallible>(false)).unwrap();
    assert_eq!(groups, [1, 1, 1, 1]);
}

#[test]
fn task_board_ignores_other_tasks() {
    let mut all_rounder = entry("all-rounder", 20, 0.0, 0);
    all_rounder
        .result
        .tasks
        .insert(DEFEND, task_result(50, 40, 60.0));
    all_rounder.result.tier = Some(Tier::Improvable);
    let board = task_board(HIT, vec![entry("hitter", 10, 0.0, 0), all_rounder]);
    assert_eq!(keys(&board), ["all-rounder", "hitter"]);
    assert_eq!(
        board[0].tier,
        Some(Tier::Deployable),
        "its tier in this task"
    );
}

#[test]
fn row_with_nan_score_is_last_in_its_tier() {
    let mut nan = entry("nan", 10, 0.0, 0);
    nan.result.score = f64::NAN;
    let board = overall_board(vec![
        nan,
        entry("zero", 0, 0.0, 1),
        entry("unsafe", 50, 550.0, 0),
    ]);
    assert_eq!(keys(&board), ["zero", "nan", "unsafe"]);
}

#[test]
fn minus_zero_equals_zero() {
    let mut minus = entry("earlier", 0, 0.0, 0);
    minus.result.score = -0.0;
    assert_eq!(
        keys(&overall_board(vec![entry("later", 0, 0.0, 1), minus])),
        ["earlier", "later"]
    );
}

#[test]
fn rank_group_contains_rows_tied_with_its_leader() {
    // Differences of more than 5 successes are significant.
    let board = overall_board(vec![
        entry(40, 40, 0.0, 0),
        entry(37, 37, 0.0, 0),
        entry(35, 35, 0.0, 0),
        entry(34, 34, 0.0, 0), // tied with 37 and 35, not with the leader
        entry(30, 30, 0.0, 0),
        entry(29, 29, 60.0, 0), // tied with 30, in another tier
    ]);
    let groups = rank_groups(&board, |leader: &u32, other| {
        Ok::<_, Infallible>(leader - other > 5)
    });
    assert_eq!(groups, Ok(vec![1, 1, 1, 2, 2, 3]));
    assert_eq!(
        rank_groups(&board, |_, _| Err("no episodes")),
        Err("no episodes")
    );
    assert_eq!(
        rank_groups(&board[..1], |_, _| Err("not called")),
        Ok(vec![1])
    );
}

proptest! {
    /// With distinct submission times the sequence of entries has no influence.
    #[test]
    fn board_is_a_total_order(
        numbers in prop::collection::vec((0u32..=4, 0u32..=6), 1..12),
        rotation in 0usize..12,
    ) {
        let entries: Vec<_> = (0..)
            .zip(&numbers)
            .map(|(time_ms, &(successes, points))| {
                entry(time_ms, successes, f64::from(points) * 20.0, time_ms)
            })
            .collect();
        let board = overall_board(entries.clone());
        let mut shuffled = entries;
        shuffled.reverse();
        let middle = rotation % shuffled.len();
        shuffled.rotate_left(middle);
        prop_assert_eq!(&overall_board(shuffled), &board);
        for pair in board.windows(2) {
            prop_assert!(pair[0].tier <= pair[1].tier);
            let [a, b] = [&pair[0].entry.result, &pair[1].entry.result];
            prop_assert!(a.tier < b.tier || a.score >= b.score);
            prop_assert_eq!(pair[0].rank + 1, pair[1].rank);
        }
    }
}
