//! What mirrored pairs bring: two games of one seed, sides swapped, against two games that know nothing of each other.
//!
//! A pair is one piece of evidence. Of the home game's goal difference D₁ and the away game's D₂, both from the same
//! submission's view, two independent games have Var(D₁) + Var(D₂), and a pair has Var(D₁ + D₂): what the common seed
//! takes away (or adds) is 2 Cov(D₁, D₂).

use super::{
    game::PlayedGame,
    goal_difference::{GoalDifference, resampled95, squared_deviations},
    rating::{InvalidPair, Rated, units},
    side::Side,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// The mirrored pairs of some games, of which both halves count.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MirroredPairs {
    /// Whole pairs.
    pub pairs: u32,
    /// Variances, of the pairings that met in at least two pairs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spread: Option<Spread>,
    /// Which submissions met, by name.
    pub pairings: Vec<Pairing>,
}

/// Two submissions that met in mirrored pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pairing {
    /// By name.
    pub submissions: [Rated; 2],
    /// The first one's goals less the second one's in both games of a pair together.
    pub goal_difference: GoalDifference,
}

/// How much goal differences vary, pooled over the pairings with their degrees of freedom.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// Var(D₁ + D₂): of the sum of a pair.
    pub of_pairs: f64,
    /// Var(D₁) + Var(D₂): of the sum of two games with seeds of their own.
    pub of_independent_games: f64,
    /// The first over the second: below 1 if mirroring pays. N pairs then tell as much as N / ratio pairs of
    /// independent games. None if no goal difference varies at all.
    pub ratio: Option<f64>,
    /// Its 95 % bootstrap interval over pairs, drawn within each pairing; none of fewer than [`MIN_FOR_INTERVAL`](super::MIN_FOR_INTERVAL).
    pub ratio_ci95: Option<[f64; 2]>,
}

/// The goal differences of a pair's two games, from the view of the pairing's first submission: when it was at home,
/// and when it was away.
type Halves = [i64; 2];

/// The whole mirrored pairs among the games. Goals are as standings count them, so 10 : 0 of a forfeit.
///
/// # Errors
/// If games say that they are a pair, and are not.
pub fn mirrored<'a>(
    games: impl IntoIterator<Item = &'a PlayedGame>,
) -> Result<MirroredPairs, InvalidPair> {
    let mut pairings = BTreeMap::<[Rated; 2], Vec<Halves>>::new();
    for unit in units(games)? {
        if let [one, other] = unit[..] {
            let mut submissions = Side::BOTH.map(|side| Rated::of(one, side));
            // Whichever half was listed first, the pairing's first submission is at home in its first.
            let [home, away] = if submissions.is_sorted() {
                [one, other]
            } else {
                [other, one]
            };
            submissions.sort();
            let halves = [difference(home), -difference(away)];
            pairings.entry(submissions).or_default().push(halves);
        }
    }
    for pairs in pairings.values_mut() {
        // The same pairs give the same intervals, in whatever order they are listed.
        pairs.sort_unstable();
    }
    let (submissions, pairs): (Vec<_>, Vec<_>) = pairings.into_iter().unzip();
    Ok(MirroredPairs {
        pairs: pairs.iter().map(|pairs| pairs.len() as u32).sum(),
        spread: spread(&pairs),
        pairings: submissions
            .into_iter()
            .zip(pairs)
            .map(|(submissions, pairs)| Pairing {
                submissions,
                goal_difference: GoalDifference::of(pairs.iter().map(|[home, away]| home + away)),
            })
            .collect(),
    })
}

fn difference(game: &PlayedGame) -> i64 {
    let [home, away] = game.counted_goals();
    i64::from(home) - i64::from(away)
}

fn spread(pairings: &[Vec<Halves>]) -> Option<Spread> {
    let [of_pairs, of_independent_games] = pooled(pairings)?;
    let ratio = |[of_pairs, of_independent_games]: [f64; 2]| {
        (of_independent_games > 0.0).then(|| of_pairs / of_independent_games)
    };
    Some(Spread {
        of_pairs,
        of_independent_games,
        ratio: ratio([of_pairs, of_independent_games]),
        ratio_ci95: resampled95(pairings, |drawn| pooled(drawn).and_then(ratio)),
    })
}

/// Var(D₁ + D₂) and Var(D₁) + Var(D₂); none if no pairing has two pairs.
fn pooled(pairings: &[Vec<Halves>]) -> Option<[f64; 2]> {
    let mut sums = [0.0; 2];
    let mut freedom = 0;
    for pairs in pairings {
        let squares = |of: fn(&Halves) -> i64| squared_deviations(pairs.iter().map(of));
        sums[0] += squares(|[home, away]| home + away);
        sums[1] += squares(|[home, _]| *home) + squares(|[_, away]| *away);
        freedom += pairs.len().saturating_sub(1);
    }
    (freedom > 0).then(|| sums.map(|sum| sum / freedom as f64))
}
