//! Mean goal differences, and how sure such numbers are: the bootstrap over what was played as a whole.

use crate::draws::Draws;
use serde::Serialize;

/// Of fewer pieces of evidence no interval is made: a bootstrap of a handful says that it is surer than it is.
pub const MIN_FOR_INTERVAL: u32 = 10;

/// Samples that are drawn for an interval.
const RESAMPLES: usize = 2000;

/// Names the stream of draws; another way of drawing is another stream.
const STREAM: &str = "faceoff-scoring goal differences bootstrap 1";

/// One side's goals less the other's, over games or over mirrored pairs, each of which is one piece of evidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GoalDifference {
    /// Games or pairs.
    pub of: u32,
    /// Their mean; of none 0.
    pub mean: f64,
    /// 95 % bootstrap interval of the mean; none of fewer than [`MIN_FOR_INTERVAL`].
    pub mean_ci95: Option<[f64; 2]>,
    /// Their variance (by n − 1); none of fewer than two.
    pub variance: Option<f64>,
}

impl GoalDifference {
    /// Of each game or pair.
    #[must_use]
    pub fn of(differences: impl IntoIterator<Item = i64>) -> Self {
        let mut all: Vec<_> = differences.into_iter().map(|one| [one]).collect();
        // The same differences give the same interval, in whatever order they are listed.
        all.sort_unstable();
        let values = || all.iter().map(|[one]| *one);
        let count = all.len();
        Self {
            of: u32::try_from(count).unwrap_or(u32::MAX),
            mean: mean(values()),
            mean_ci95: resampled95(std::slice::from_ref(&all), |drawn| {
                Some(mean(drawn[0].iter().map(|[one]| *one)))
            }),
            variance: (count > 1).then(|| squared_deviations(values()) / (count - 1) as f64),
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = i64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<i64>() as f64 / count
}

/// Σ (x − x̄)², in whole numbers up to the last division: the same in any order.
pub(super) fn squared_deviations(values: impl Iterator<Item = i64>) -> f64 {
    let (mut count, mut sum, mut squares) = (0_i128, 0_i128, 0_i128);
    for value in values.map(i128::from) {
        count += 1;
        sum += value;
        squares += value * value;
    }
    (count * squares - sum * sum) as f64 / count.max(1) as f64
}

/// The 2.5 % and 97.5 % points of a number over samples, which draw with replacement within each group as many as it
/// has. None of fewer than [`MIN_FOR_INTERVAL`] in all, or where less than half of the samples give that number.
///
/// The draws come from BLAKE3 keyed with the groups themselves, which the caller has put in order.
pub(super) fn resampled95<const N: usize>(
    groups: &[Vec<[i64; N]>],
    number: impl Fn(&[Vec<[i64; N]>]) -> Option<f64>,
) -> Option<[f64; 2]> {
    if groups.iter().map(Vec::len).sum::<usize>() < MIN_FOR_INTERVAL as usize {
        return None;
    }
    let mut draws = Draws::new(key(groups).finalize_xof());
    let mut drawn = groups.to_vec();
    let mut numbers: Vec<f64> = (0..RESAMPLES)
        .filter_map(|_| {
            for (drawn, group) in drawn.iter_mut().zip(groups) {
                let count = u32::try_from(group.len()).expect("a file of games is far shorter");
                drawn.fill_with(|| group[draws.below(count)]);
            }
            number(&drawn)
        })
        .collect();
    if numbers.len() < RESAMPLES / 2 {
        return None;
    }
    numbers.sort_unstable_by(f64::total_cmp);
    // The smallest value that at least this share of the samples does not exceed.
    let at = |per_mille: usize| numbers[(per_mille * numbers.len()).div_ceil(1000) - 1];
    Some([at(25), at(975)])
}

fn key<const N: usize>(groups: &[Vec<[i64; N]>]) -> blake3::Hasher {
    let mut key = blake3::Hasher::new_derive_key(STREAM);
    for group in groups {
        key.update(&(group.len() as u64).to_le_bytes());
        for value in group.as_flattened() {
            key.update(&value.to_le_bytes());
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_variance_and_interval_are_those_of_the_formulas() {
        let all: Vec<i64> = (0..100).map(|n| n % 5 - 1).collect();
        let told = GoalDifference::of(all.iter().copied());
        assert_eq!((told.of, told.mean), (100, 1.0));
        // −1, 0, 1, 2, 3, twenty times each: Σ (x − 1)² = 20 · 10
        assert_eq!(told.variance, Some(200.0 / 99.0));
        // ± 1.96 · √(2 / 100) of the normal approximation
        let [low, high] = told.mean_ci95.unwrap();
        assert!((low - (1.0 - 0.277)).abs() < 0.05, "{low}");
        assert!((high - (1.0 + 0.277)).abs() < 0.05, "{high}");
        assert_eq!(GoalDifference::of(all.into_iter().rev()), told);
    }

    #[test]
    fn of_a_handful_no_interval_is_made() {
        let nine = GoalDifference::of(0..9);
        assert_eq!((nine.mean, nine.mean_ci95), (4.0, None));
        assert!(GoalDifference::of(0..10).mean_ci95.is_some());
        let one = GoalDifference::of([3]);
        assert_eq!((one.mean, one.variance), (3.0, None));
        assert_eq!(GoalDifference::of([]).mean, 0.0);
    }
}
