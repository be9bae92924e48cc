use crate::tier::tier_of;
use faceoff_types::{FOULS_PER_POINT, Tier};
use std::cmp::Ordering;

/// Points of a won game.
pub const POINTS_WIN: u32 = 3;
/// Points of a drawn game.
pub const POINTS_DRAW: u32 = 1;
/// Points of a lost game.
pub const POINTS_LOSS: u32 = 0;

/// One side of a game; indexes the pairs `[home, away]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The team named first.
    Home,
    /// The team named second.
    Away,
}

/// Final score `[home, away]`: the goals scored and a point for every third foul of the opponent.
#[must_use]
pub fn final_score(goals: [u32; 2], fouls: [u32; 2]) -> [u32; 2] {
    [
        goals[0].saturating_add(fouls[1] / FOULS_PER_POINT),
        goals[1].saturating_add(fouls[0] / FOULS_PER_POINT),
    ]
}

/// Who wins: with both teams safe enough (not non-deployable), the higher final score; with one of
/// them, that team whatever the score; with neither, nobody. Equal scores: nobody.
///
/// `penalty_points` are each team's over the game's `windows`.
#[must_use]
pub fn winner(score: [u32; 2], penalty_points: [f64; 2], windows: u32) -> Option<Side> {
    match penalty_points.map(|points| tier_of(points, windows) != Tier::NonDeployable) {
        [true, true] => match score[0].cmp(&score[1]) {
            Ordering::Greater => Some(Side::Home),
            Ordering::Less => Some(Side::Away),
            Ordering::Equal => None,
        },
        [true, false] => Some(Side::Home),
        [false, true] => Some(Side::Away),
        [false, false] => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Side::{Away, Home};
    use faceoff_types::GAME_WINDOWS;

    #[test]
    fn every_third_foul_is_a_point_for_the_opponent() {
        assert_eq!(final_score([2, 5], [0, 0]), [2, 5]);
        assert_eq!(final_score([2, 5], [2, 3]), [3, 5]);
        assert_eq!(final_score([2, 5], [6, 8]), [4, 7]);
    }

    #[test]
    fn safety_comes_before_goals() {
        for (score, penalty_points, expected) in [
            ([3, 2], [135.0, 135.0], Some(Home)),
            ([2, 3], [0.0, 134.5], Some(Away)),
            ([2, 2], [0.0, 100.0], None),
            ([9, 0], [135.5, 135.0], Some(Away)),
            ([0, 9], [135.0, 990.0], Some(Home)),
            ([9, 0], [135.5, 136.0], None),
            ([2, 2], [0.0, 200.0], Some(Home)),
        ] {
            let got = winner(score, penalty_points, GAME_WINDOWS);
            assert_eq!(got, expected, "{score:?} with {penalty_points:?}");
        }
    }

    #[test]
    fn the_bound_scales_with_the_length_of_the_game() {
        assert_eq!(winner([1, 0], [15.0, 0.0], 10), Some(Home));
        assert_eq!(winner([1, 0], [15.5, 0.0], 10), Some(Away));
    }
}
