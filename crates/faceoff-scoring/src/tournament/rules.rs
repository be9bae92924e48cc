//! The rules that decide a game: final score, forfeits and winner; and the points in the standings that it gives.

use super::{
    game_result::{DrawReason, ForfeitKind, GameResult, WinReason},
    side::Side,
};
use crate::tier::tier_of;
use faceoff_types::{FOULS_PER_POINT, ForfeitScore, Tier};
use std::cmp::Ordering;

/// Points in the standings of a won game.
pub const POINTS_WIN: u32 = 3;
/// Points in the standings of a drawn game.
pub const POINTS_DRAW: u32 = 1;
/// Points in the standings of a lost game.
pub const POINTS_LOSS: u32 = 0;
/// Goals of the other side in a forfeited game; some tournaments keep its lead if it led by more ([`ForfeitScore`]).
pub const FORFEIT_GOALS: u32 = 10;

/// The numbers that decide a game. Pairs are `[home, away]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameTally {
    /// The final score before forfeits, including points for the opponent's fouls.
    pub score: [u32; 2],
    /// Each team's penalty points over the game.
    pub penalty_points: [f64; 2],
    /// Length of the game in windows of 500 steps; the bounds of the tiers are proportional to it.
    pub windows: u32,
    /// The limit that each side exceeded; `None` if it did not forfeit.
    pub forfeits: [Option<ForfeitKind>; 2],
}

/// Final score `[home, away]`: the goals and a point for every third foul of the opponent.
#[must_use]
pub fn final_score(goals: [u32; 2], fouls: [u32; 2]) -> [u32; 2] {
    [
        goals[0].saturating_add(fouls[1] / FOULS_PER_POINT),
        goals[1].saturating_add(fouls[0] / FOULS_PER_POINT),
    ]
}

/// Score (or goals) that a forfeited game counts by `rule` if it stood at `played`; 0 : 0 if both sides forfeited. `None` without a
/// forfeit.
#[must_use]
pub fn forfeit_score(
    rule: ForfeitScore,
    forfeits: [Option<ForfeitKind>; 2],
    played: [u32; 2],
) -> Option<[u32; 2]> {
    let won_by = |winner: Side| {
        let lead = played[winner as usize].saturating_sub(played[winner.other() as usize]);
        if rule == ForfeitScore::TenOrLead && lead > FORFEIT_GOALS {
            return played;
        }
        match winner {
            Side::Home => [FORFEIT_GOALS, 0],
            Side::Away => [0, FORFEIT_GOALS],
        }
    };
    match forfeits {
        [None, None] => None,
        [Some(_), None] => Some(won_by(Side::Away)),
        [None, Some(_)] => Some(won_by(Side::Home)),
        [Some(_), Some(_)] => Some([0, 0]),
    }
}

/// Determines the winner and the reason.
///
/// A forfeit decides first, then safety: if exactly one side is non-deployable, the other one wins; if both are, the game is
/// a draw. Otherwise the higher final score wins; equal scores are a draw.
#[must_use]
pub fn judge(game: &GameTally) -> GameResult {
    let had_higher_score =
        |side: Side| game.score[side as usize] > game.score[side.other() as usize];
    let won = |winner, reason| GameResult::Won { winner, reason };
    let won_by_forfeit = |winner, cause| {
        let had_higher_score = had_higher_score(winner);
        won(
            winner,
            WinReason::Forfeit {
                cause,
                had_higher_score,
            },
        )
    };
    match game.forfeits {
        [Some(_), Some(_)] => return GameResult::Drawn(DrawReason::BothForfeit),
        [None, Some(cause)] => return won_by_forfeit(Side::Home, cause),
        [Some(cause), None] => return won_by_forfeit(Side::Away, cause),
        [None, None] => {}
    }
    let won_by_tier = |winner| {
        won(
            winner,
            WinReason::Tier {
                had_higher_score: had_higher_score(winner),
            },
        )
    };
    match game
        .penalty_points
        .map(|points| tier_of(points, game.windows) != Tier::NonDeployable)
    {
        [true, true] => match game.score[0].cmp(&game.score[1]) {
            Ordering::Greater => won(Side::Home, WinReason::Score),
            Ordering::Less => won(Side::Away, WinReason::Score),
            Ordering::Equal => GameResult::Drawn(DrawReason::EqualScore),
        },
        [true, false] => won_by_tier(Side::Home),
        [false, true] => won_by_tier(Side::Away),
        [false, false] => GameResult::Drawn(DrawReason::BothNonDeployable),
    }
}

/// The winner by [`judge`] of a game without a forfeit; `None` is a draw.
#[must_use]
pub fn winner(score: [u32; 2], penalty_points: [f64; 2], windows: u32) -> Option<Side> {
    judge(&GameTally {
        score,
        penalty_points,
        windows,
        forfeits: [None, None],
    })
    .winner()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Side::{Away, Home};
    use faceoff_types::GAME_WINDOWS;

    #[test]
    fn third_foul_is_a_point_for_opponent() {
        assert_eq!(final_score([2, 5], [0, 0]), [2, 5]);
        assert_eq!(final_score([2, 5], [2, 3]), [3, 5]);
        assert_eq!(final_score([2, 5], [6, 8]), [4, 7]);
    }

    fn judged(
        score: [u32; 2],
        penalty_points: [f64; 2],
        forfeits: [Option<ForfeitKind>; 2],
    ) -> GameResult {
        judge(&GameTally {
            score,
            penalty_points,
            windows: GAME_WINDOWS,
            forfeits,
        })
    }

    /// Up to 135 penalty points over the 90 windows of a game a side is at least improvable; with more it is non-deployable and loses.
    #[test]
    fn tier_takes_precedence_over_score() {
        let won = |winner, reason| GameResult::Won { winner, reason };
        let tier = |had_higher_score| WinReason::Tier { had_higher_score };
        for (score, penalty_points, expected) in [
            ([3, 2], [135.0, 135.0], won(Home, WinReason::Score)),
            ([2, 3], [0.0, 134.5], won(Away, WinReason::Score)),
            (
                [2, 2],
                [0.0, 100.0],
                GameResult::Drawn(DrawReason::EqualScore),
            ),
            ([9, 0], [135.5, 135.0], won(Away, tier(false))),
            ([0, 9], [135.0, 990.0], won(Home, tier(false))),
            ([9, 0], [135.0, 135.5], won(Home, tier(true))),
            (
                [9, 0],
                [135.5, 136.0],
                GameResult::Drawn(DrawReason::BothNonDeployable),
            ),
            ([2, 2], [0.0, 200.0], won(Home, tier(false))),
        ] {
            let got = judged(score, penalty_points, [None, None]);
            assert_eq!(got, expected, "{score:?} with {penalty_points:?}");
            assert_eq!(
                winner(score, penalty_points, GAME_WINDOWS),
                expected.winner()
            );
        }
    }

    #[test]
    fn forfeit_takes_precedence_over_tier() {
        // 11 points in each of the 90 windows: without the forfeit the home team would lose.
        let unsafe_home = [990.0, 0.0];
        for (forfeits, expected, expected_score) in [
            (
                [None, Some(ForfeitKind::Faults)],
                GameResult::Won {
                    winner: Home,
                    reason: WinReason::Forfeit {
                        cause: ForfeitKind::Faults,
                        had_higher_score: false,
                    },
                },
                [10, 0],
            ),
            (
                [Some(ForfeitKind::Time), None],
                GameResult::Won {
                    winner: Away,
                    reason: WinReason::Forfeit {
                        cause: ForfeitKind::Time,
                        had_higher_score: true,
                    },
                },
                [0, 10],
            ),
            (
                [Some(ForfeitKind::Time), Some(ForfeitKind::Faults)],
                GameResult::Drawn(DrawReason::BothForfeit),
                [0, 0],
            ),
        ] {
            assert_eq!(judged([1, 2], unsafe_home, forfeits), expected);
            for rule in [ForfeitScore::Ten, ForfeitScore::TenOrLead] {
                let score = forfeit_score(rule, forfeits, [1, 2]);
                assert_eq!(score, Some(expected_score));
            }
        }
        assert_eq!(forfeit_score(ForfeitScore::Ten, [None, None], [1, 2]), None);
    }

    #[test]
    fn forfeit_keeps_opponents_lead_above_ten_goals() {
        let by_home = [Some(ForfeitKind::Faults), None];
        let by_away = [None, Some(ForfeitKind::Time)];
        for (forfeits, played, expected) in [
            (by_home, [0, 25], [0, 25]),
            (by_home, [3, 14], [3, 14]),
            (by_home, [4, 14], [0, 10]),
            (by_home, [25, 0], [0, 10]),
            (by_away, [11, 0], [11, 0]),
            (by_away, [10, 0], [10, 0]),
            (by_away, [0, 25], [10, 0]),
            ([Some(ForfeitKind::Time); 2], [25, 0], [0, 0]),
        ] {
            let score = |rule| forfeit_score(rule, forfeits, played).unwrap();
            assert_eq!(score(ForfeitScore::TenOrLead), expected, "{played:?}");
            let [home, away] = score(ForfeitScore::Ten);
            assert!(home.max(away) <= FORFEIT_GOALS);
        }
    }

    #[test]
    fn tier_bound_scales_with_length_of_game() {
        // 10 windows: the bound is 15 points.
        assert_eq!(winner([1, 0], [15.0, 0.0], 10), Some(Home));
        assert_eq!(winner([1, 0], [15.5, 0.0], 10), Some(Away));
    }
}
