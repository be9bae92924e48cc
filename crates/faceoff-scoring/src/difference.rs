//! 95 % intervals of the differences between two evaluations, A and B, in success rates and overall scores.
//!
//! They use the square-and-add method: the margin of a sum is the root of the summed squares of the margins of its parts
//! (Newcombe, Statistics in Medicine 17, 1998; Zou and Donner, Statistics in Medicine 27, 2008).

use crate::{evaluation::weight_percent, interval::wilson95, paired_tests::PairedTally};
use faceoff_types::{Task, TaskWeights};

/// An estimate and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Estimate {
    /// A success rate with its Wilson interval.
    fn rate(successes: u32, episodes: u32) -> Self {
        let [low, high] = wilson95(successes, episodes);
        Self {
            value: f64::from(successes) / f64::from(episodes.max(1)),
            low,
            high,
        }
    }

    /// Distance of the lower bound from the estimate.
    fn lower_margin(self) -> f64 {
        self.value - self.low
    }

    /// Distance of the upper bound from the estimate.
    fn upper_margin(self) -> f64 {
        self.high - self.value
    }

    /// `a − b` of two rates; `phi` is the correlation of their episodes' successes, 0 for independent episodes.
    fn difference(a: Self, b: Self, phi: f64) -> Self {
        let margin = |a: f64, b: f64| (a * a - 2.0 * phi * a * b + b * b).max(0.0).sqrt();
        let value = a.value - b.value;
        Self {
            value,
            low: (value - margin(a.lower_margin(), b.upper_margin())).max(-1.0),
            high: (value + margin(a.upper_margin(), b.lower_margin())).min(1.0),
        }
    }

    pub(crate) fn excludes_zero(self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }
}

/// Success rate of A minus that of B on the same episodes, with Newcombe's paired score interval (method 10 of his
/// comparison).
pub(crate) fn paired_difference(tally: &PairedTally) -> Estimate {
    let n = tally.episodes();
    let (a, b) = (tally.both + tally.only_a, tally.both + tally.only_b);
    Estimate::difference(Estimate::rate(a, n), Estimate::rate(b, n), phi(tally))
}

/// The phi coefficient: the correlation of the successes of A and B. A positive one is shrunk towards 0, since a
/// correlation that may be due to chance must not narrow the interval.
fn phi(tally: &PairedTally) -> f64 {
    let [both, only_a, only_b, neither] =
        [tally.both, tally.only_a, tally.only_b, tally.neither].map(f64::from);
    let margins = (both + only_a) * (only_b + neither) * (both + only_b) * (only_a + neither);
    if margins == 0.0 {
        return 0.0;
    }
    let product = both * neither - only_a * only_b;
    // Newcombe's continuity correction.
    let correction = f64::from(tally.episodes()) / 2.0;
    let shrunk = if product > correction {
        product - correction
    } else {
        product.min(0.0)
    };
    shrunk / margins.sqrt()
}

/// As [`paired_difference`], for `[successes, episodes]` of A and B on different episodes (Newcombe's score interval
/// for independent proportions).
pub(crate) fn unpaired_difference(a: [u32; 2], b: [u32; 2]) -> Estimate {
    Estimate::difference(Estimate::rate(a[0], a[1]), Estimate::rate(b[0], b[1]), 0.0)
}

/// The difference of the overall scores in percentage points, from the tasks' differences of rates.
/// The tasks' episodes are independent of each other.
pub(crate) fn score_difference(
    weights: &TaskWeights,
    tasks: impl IntoIterator<Item = (Task, Estimate)>,
) -> Estimate {
    let (mut value, mut lower_squares, mut upper_squares) = (0.0, 0.0, 0.0);
    for (task, difference) in tasks {
        let weight = weight_percent(weights, task);
        value += weight * difference.value;
        lower_squares += (weight * difference.lower_margin()).powi(2);
        upper_squares += (weight * difference.upper_margin()).powi(2);
    }
    Estimate {
        value,
        low: value - lower_squares.sqrt(),
        high: value + upper_squares.sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paired_tests::tests::tally;
    use faceoff_airhockey::TASKS;
    use statrs::distribution::{Binomial, Discrete};

    /// The values come from a separate implementation of the formula in the paper.
    #[test]
    fn paired_interval_is_newcombes_method_10() {
        for (tally, low, high) in [
            (tally(20, 12, 2, 16), 0.056_156_4, 0.329_207_0),
            (tally(36, 12, 2, 0), 0.056_929_6, 0.340_427_6),
            (tally(54, 0, 0, 0), -0.066_413_6, 0.066_413_6),
            (tally(43, 0, 1, 0), -0.118_077_1, 0.059_718_0),
            (tally(1, 97, 1, 1), 0.873_672_2, 0.985_025_8),
        ] {
            let got = paired_difference(&tally);
            assert!(
                (got.low - low).abs() < 1e-6 && (got.high - high).abs() < 1e-6,
                "{tally:?}: {got:?}, expected {low} to {high}"
            );
        }
    }

    /// The probability that the interval contains the true difference, summed over all possible results of 24 episodes.
    #[test]
    fn paired_interval_has_about_nominal_coverage() {
        const EPISODES: u32 = 24;
        // Probabilities that both, only A, only B or neither solve an episode.
        for cells in [
            [0.3, 0.2, 0.2, 0.3],
            [0.5, 0.25, 0.05, 0.2],
            [0.7, 0.1, 0.1, 0.1],
            [0.25, 0.25, 0.25, 0.25],
            [0.05, 0.6, 0.05, 0.3],
        ] {
            let truth = cells[1] - cells[2];
            // The multinomial probability is a product of binomial ones: both, then only A, then only B, each among the
            // remaining episodes.
            let probability =
                |p: f64, n: u32, k: u32| Binomial::new(p, u64::from(n)).unwrap().pmf(u64::from(k));
            let mut covered = 0.0;
            for both in 0..=EPISODES {
                for only_a in 0..=EPISODES - both {
                    for only_b in 0..=EPISODES - both - only_a {
                        let counts = tally(both, only_a, only_b, EPISODES - both - only_a - only_b);
                        let difference = paired_difference(&counts);
                        if difference.low <= truth && truth <= difference.high {
                            let not_both = 1.0 - cells[0];
                            let remaining = EPISODES - both;
                            covered += probability(cells[0], EPISODES, both)
                                * probability(cells[1] / not_both, remaining, only_a)
                                * probability(
                                    cells[2] / (not_both - cells[1]),
                                    remaining - only_a,
                                    only_b,
                                );
                        }
                    }
                }
            }
            assert!((0.93..0.995).contains(&covered), "{cells:?}: {covered}");
        }
    }

    #[test]
    fn score_interval_weights_tasks() {
        let task_difference = Estimate {
            value: 0.1,
            low: 0.0,
            high: 0.3,
        };
        let score = score_difference(
            &TaskWeights::parse("0.4,0.4,0.2", TASKS.into_iter()).unwrap(),
            TASKS.map(|task| (task, task_difference)),
        );
        assert!((score.value - 10.0).abs() < 1e-12);
        // With the default weights 40, 40 and 20 the margins are √(40² + 40² + 20²) = 60 times those of one task.
        assert!((score.low - 4.0).abs() < 1e-12, "{score:?}");
        assert!((score.high - 22.0).abs() < 1e-12, "{score:?}");
        assert!(score.excludes_zero() && !task_difference.excludes_zero());
    }
}
