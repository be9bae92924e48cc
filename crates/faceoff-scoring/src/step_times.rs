//! Statistics of an agent's computation times: mean, 99th percentile and maximum, without storing all times.

use faceoff_types::ComputationTimeSummary;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Statistics of the computation times of a task's answered steps, added in the sequence of the steps.
///
/// Stored are the sum and the largest hundredth of the times, which contains the maximum and the 99th percentile.
#[derive(Debug, Clone, Default)]
pub struct StepTimes {
    expected_count: u64,
    count: u64,
    sum_s: f64,
    /// The largest times, the shortest of them on top of the heap. They are stored as the bits of the floating-point
    /// numbers, which sort like the numbers if none is negative.
    largest: BinaryHeap<Reverse<u64>>,
}

impl StepTimes {
    /// Statistics for exactly `steps` times: the rank of the percentile depends on their number.
    #[must_use]
    pub fn for_steps(steps: u64) -> Self {
        Self {
            expected_count: steps,
            ..Self::default()
        }
    }

    /// Adds a time in seconds; it must not be negative.
    pub fn add(&mut self, time_s: f64) {
        self.count += 1;
        self.sum_s += time_s;
        let time = Reverse(time_s.to_bits());
        if self.largest.len() < self.retained_count() {
            self.largest.push(time);
        } else if let Some(mut shortest) = self.largest.peek_mut()
            && time < *shortest
        {
            *shortest = time;
        }
    }

    /// Number of times added.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// Number of times from the nearest rank of the percentile to the maximum.
    fn retained_count(&self) -> usize {
        let below_percentile = (self.expected_count * 99).div_ceil(100).saturating_sub(1);
        usize::try_from(self.expected_count - below_percentile).unwrap_or(usize::MAX)
    }

    /// Mean, 99th percentile (nearest rank) and maximum; zeros without steps.
    ///
    /// # Panics
    /// If more or fewer times were added than expected: the percentile would be wrong.
    pub(crate) fn summary(&self) -> ComputationTimeSummary {
        assert_eq!(
            self.count, self.expected_count,
            "the number of added times differs from the expected one"
        );
        let (Some(Reverse(p99)), Some(Reverse(max))) =
            (self.largest.peek(), self.largest.iter().min())
        else {
            return ComputationTimeSummary::default();
        };
        ComputationTimeSummary {
            mean: self.sum_s / self.count as f64,
            p99: f64::from_bits(*p99),
            max: f64::from_bits(*max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn summary(times_s: &[f64]) -> ComputationTimeSummary {
        let mut times = StepTimes::for_steps(times_s.len() as u64);
        times_s.iter().for_each(|time_s| times.add(*time_s));
        times.summary()
    }

    #[test]
    fn percentile_is_nearest_rank() {
        let hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let summary_of_hundred = summary(&hundred);
        assert_eq!(
            (
                summary_of_hundred.mean,
                summary_of_hundred.p99,
                summary_of_hundred.max
            ),
            (50.5, 99.0, 100.0)
        );
        assert_eq!(summary(&[0.5]).p99, 0.5);
        assert_eq!(summary(&[3.0, 1.0, 2.0]).p99, 3.0);
        assert_eq!(summary(&[]), ComputationTimeSummary::default());
    }

    #[test]
    fn only_the_largest_hundredth_of_times_is_stored() {
        let mut times = StepTimes::for_steps(1_000_000);
        for index in 0..1_000_000u32 {
            // 7919 is a prime: the times 0 to 7918 repeat without a pattern that fits 1,000,000.
            times.add(f64::from(index % 7919));
            assert!(times.largest.len() <= 10_001);
        }
        assert!(times.largest.capacity() <= 2 * 10_001);
        assert_eq!(times.summary().max, 7918.0);
    }

    proptest! {
        #[test]
        fn summary_equals_that_of_all_times(
            // Few distinct values give ties, many give none.
            mut times_s in prop_oneof![
                prop::collection::vec((0u8..5).prop_map(|n| f64::from(n) * 1e-3), 1..1500),
                prop::collection::vec(0.0..1.0f64, 1..1500),
            ]
        ) {
            let found = summary(&times_s);
            let mean = times_s.iter().sum::<f64>() / times_s.len() as f64;
            prop_assert_eq!(found.mean.to_bits(), mean.to_bits());
            times_s.sort_unstable_by(f64::total_cmp);
            let rank = (times_s.len() * 99).div_ceil(100);
            prop_assert_eq!(found.p99, times_s[rank - 1]);
            prop_assert_eq!(found.max, times_s[times_s.len() - 1]);
        }
    }
}
