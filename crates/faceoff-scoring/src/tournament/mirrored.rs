//! Variance of mirrored pairs (two games with the same seed and swapped sides), compared with independent games.
//!
//! A pair is one observation. D₁ and D₂ are the goal differences of one submission in its home game and its away game.
//! Two independent games have the variance Var(D₁) + Var(D₂), a pair has Var(D₁ + D₂): the common seed adds
//! 2 Cov(D₁, D₂), which may be negative.

use super::{
    game::PlayedGame,
    goal_difference::{GoalDifference, bootstrap_ci95, squared_deviations},
    rating::{InvalidPair, RatedSubmission, sampling_units},
    side::Side,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// The complete mirrored pairs in a list of games.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MirroredPairs {
    /// Number of complete pairs.
    pub pairs: u32,
    /// Variances over the pairings with at least two pairs; `None` without such a pairing.
    #[serde(rename = "spread", skip_serializing_if = "Option::is_none")]
    pub variances: Option<VarianceComparison>,
    /// One entry for each two submissions that met, sorted by name.
    pub pairings: Vec<SubmissionPairing>,
}

/// Two submissions that met in mirrored pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubmissionPairing {
    /// The two submissions, sorted by name.
    pub submissions: [RatedSubmission; 2],
    /// Goals of the first minus those of the second, summed over both games of a pair.
    pub goal_difference: GoalDifference,
}

/// Variances of goal differences, in goals², pooled over the pairings by their degrees of freedom.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VarianceComparison {
    /// Var(D₁ + D₂), the variance of the sum of a pair.
    pub of_pairs: f64,
    /// Var(D₁) + Var(D₂), the variance of the sum of two games with different seeds.
    pub of_independent_games: f64,
    /// `of_pairs` / `of_independent_games`. If it is below 1, mirroring reduces the variance: N mirrored pairs are as exact
    /// as N / `ratio` pairs of independent games. `None` if all goal differences are equal.
    pub ratio: Option<f64>,
    /// 95 % interval of `ratio` by a bootstrap over pairs, drawn within each pairing; `None` below
    /// [`MIN_FOR_INTERVAL`](super::MIN_FOR_INTERVAL) pairs.
    pub ratio_ci95: Option<[f64; 2]>,
}

/// Goal differences of a pair for the first submission of the pairing: `[home game, away game]`.
type PairDifferences = [i64; 2];

/// Finds the complete mirrored pairs. Goals are those of the standings, so 10 : 0 or more for a forfeit.
///
/// # Errors
/// If games with the same pair number are not a mirrored pair.
pub fn find_mirrored_pairs<'a>(
    games: impl IntoIterator<Item = &'a PlayedGame>,
) -> Result<MirroredPairs, InvalidPair> {
    let mut pairings = BTreeMap::<[RatedSubmission; 2], Vec<PairDifferences>>::new();
    for unit in sampling_units(games)? {
        if let [first, second] = unit[..] {
            let mut submissions = Side::BOTH.map(|side| RatedSubmission::from_side(first, side));
            // In the home game the first submission is at home, regardless of the sequence of the games.
            let [home, away] = if submissions.is_sorted() {
                [first, second]
            } else {
                [second, first]
            };
            submissions.sort();
            let differences = [goal_difference(home), -goal_difference(away)];
            pairings.entry(submissions).or_default().push(differences);
        }
    }
    for pairs in pairings.values_mut() {
        // Sorted, so that the intervals do not depend on the sequence of the games.
        pairs.sort_unstable();
    }
    let (submissions, pairs): (Vec<_>, Vec<_>) = pairings.into_iter().unzip();
    Ok(MirroredPairs {
        pairs: pairs.iter().map(|pairs| pairs.len() as u32).sum(),
        variances: compare_variances(&pairs),
        pairings: submissions
            .into_iter()
            .zip(pairs)
            .map(|(submissions, pairs)| SubmissionPairing {
                submissions,
                goal_difference: GoalDifference::from_differences(
                    pairs.iter().map(|[home, away]| home + away),
                ),
            })
            .collect(),
    })
}

/// Goals of the home team minus those of the away team.
fn goal_difference(game: &PlayedGame) -> i64 {
    let [home, away] = game.counted_goals();
    i64::from(home) - i64::from(away)
}

fn compare_variances(pairings: &[Vec<PairDifferences>]) -> Option<VarianceComparison> {
    let [of_pairs, of_independent_games] = pooled_variances(pairings)?;
    let ratio = |[of_pairs, of_independent_games]: [f64; 2]| {
        (of_independent_games > 0.0).then(|| of_pairs / of_independent_games)
    };
    Some(VarianceComparison {
        of_pairs,
        of_independent_games,
        ratio: ratio([of_pairs, of_independent_games]),
        ratio_ci95: bootstrap_ci95(pairings, |drawn| pooled_variances(drawn).and_then(ratio)),
    })
}

/// `[Var(D₁ + D₂), Var(D₁) + Var(D₂)]`; `None` if no pairing has two pairs.
fn pooled_variances(pairings: &[Vec<PairDifferences>]) -> Option<[f64; 2]> {
    let mut sums = [0.0; 2];
    let mut degrees_of_freedom = 0;
    for pairs in pairings {
        let squares =
            |value: fn(&PairDifferences) -> i64| squared_deviations(pairs.iter().map(value));
        sums[0] += squares(|[home, away]| home + away);
        sums[1] += squares(|[home, _]| *home) + squares(|[_, away]| *away);
        degrees_of_freedom += pairs.len().saturating_sub(1);
    }
    (degrees_of_freedom > 0).then(|| sums.map(|sum| sum / degrees_of_freedom as f64))
}
