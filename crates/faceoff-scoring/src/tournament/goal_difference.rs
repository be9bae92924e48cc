//! Mean goal differences with bootstrap intervals over games or mirrored pairs (two games with the same seed and swapped
//! sides).

use crate::random_numbers::RandomNumbers;
use serde::Serialize;

/// Minimum number of games or pairs for an interval: with fewer, a bootstrap interval is too narrow.
pub const MIN_FOR_INTERVAL: u32 = 10;

/// Bootstrap samples for an interval.
const RESAMPLES: usize = 2000;

/// Identifies the stream of random draws; a change of the method needs a new name.
const STREAM: &str = "faceoff-scoring goal differences bootstrap 1";

/// Goals of one side minus those of the other, over games or mirrored pairs; a pair counts as one observation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GoalDifference {
    /// Number of games or pairs.
    #[serde(rename = "of")]
    pub count: u32,
    /// Mean of the differences, in goals; 0 without games.
    pub mean: f64,
    /// 95 % bootstrap interval of the mean, in goals; `None` below [`MIN_FOR_INTERVAL`] observations.
    pub mean_ci95: Option<[f64; 2]>,
    /// Variance of the differences with the divisor n − 1, in goals²; `None` below two observations.
    pub variance: Option<f64>,
}

impl GoalDifference {
    /// Computes the statistics from the difference of each game or pair.
    #[must_use]
    pub fn from_differences(differences: impl IntoIterator<Item = i64>) -> Self {
        let mut observations: Vec<_> = differences.into_iter().map(|value| [value]).collect();
        // Sorted, so that the interval does not depend on the order of the differences.
        observations.sort_unstable();
        let values = || observations.iter().map(|[value]| *value);
        let count = observations.len();
        Self {
            count: u32::try_from(count).unwrap_or(u32::MAX),
            mean: mean(values()),
            mean_ci95: bootstrap_ci95(std::slice::from_ref(&observations), |drawn| {
                Some(mean(drawn[0].iter().map(|[value]| *value)))
            }),
            variance: (count > 1).then(|| squared_deviations(values()) / (count - 1) as f64),
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = i64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<i64>() as f64 / count
}

/// Σ (x − x̄)², in integers up to the last division: exact in any order.
pub(super) fn squared_deviations(values: impl Iterator<Item = i64>) -> f64 {
    let (mut count, mut sum, mut squares) = (0_i128, 0_i128, 0_i128);
    for value in values.map(i128::from) {
        count += 1;
        sum += value;
        squares += value * value;
    }
    (count * squares - sum * sum) as f64 / count.max(1) as f64
}

/// The 2.5 % and 97.5 % quantiles of a statistic over bootstrap samples, which draw with replacement within each group.
/// `None` below [`MIN_FOR_INTERVAL`] observations in all groups, or if `statistic` is `None` for more than half of the
/// samples.
///
/// An observation consists of `N` numbers. The draws come from BLAKE3 keyed with the groups, which the caller has sorted.
pub(super) fn bootstrap_ci95<const N: usize>(
    groups: &[Vec<[i64; N]>],
    statistic: impl Fn(&[Vec<[i64; N]>]) -> Option<f64>,
) -> Option<[f64; 2]> {
    if groups.iter().map(Vec::len).sum::<usize>() < MIN_FOR_INTERVAL as usize {
        return None;
    }
    let mut random_numbers = RandomNumbers::new(key(groups).finalize_xof());
    let mut drawn = groups.to_vec();
    let mut values: Vec<f64> = (0..RESAMPLES)
        .filter_map(|_| {
            for (drawn, group) in drawn.iter_mut().zip(groups) {
                let count = u32::try_from(group.len()).expect("a file of games is far shorter");
                drawn.fill_with(|| group[random_numbers.below(count)]);
            }
            statistic(&drawn)
        })
        .collect();
    if values.len() < RESAMPLES / 2 {
        return None;
    }
    values.sort_unstable_by(f64::total_cmp);
    // The smallest value that at least this share of the samples does not exceed.
    let quantile = |per_mille: usize| values[(per_mille * values.len()).div_ceil(1000) - 1];
    Some([quantile(25), quantile(975)])
}

/// The key of the random draws: a hash of the groups.
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
    fn mean_variance_and_interval_follow_formulas() {
        let differences: Vec<i64> = (0..100).map(|n| n % 5 - 1).collect();
        let result = GoalDifference::from_differences(differences.iter().copied());
        assert_eq!((result.count, result.mean), (100, 1.0));
        // −1, 0, 1, 2, 3, twenty times each: Σ (x − 1)² = 20 · 10
        assert_eq!(result.variance, Some(200.0 / 99.0));
        // ± 1.96 · √(2 / 100) of the normal approximation
        let [low, high] = result.mean_ci95.unwrap();
        assert!((low - (1.0 - 0.277)).abs() < 0.05, "{low}");
        assert!((high - (1.0 + 0.277)).abs() < 0.05, "{high}");
        assert_eq!(
            GoalDifference::from_differences(differences.into_iter().rev()),
            result
        );
    }

    #[test]
    fn interval_needs_ten_observations() {
        let nine = GoalDifference::from_differences(0..9);
        assert_eq!((nine.mean, nine.mean_ci95), (4.0, None));
        assert!(GoalDifference::from_differences(0..10).mean_ci95.is_some());
        let one = GoalDifference::from_differences([3]);
        assert_eq!((one.mean, one.variance), (3.0, None));
        assert_eq!(GoalDifference::from_differences([]).mean, 0.0);
    }
}
