//! The Bradley–Terry model: side a wins a trial (a game or a goal) against b with probability 1 / (1 + e^(θ_b − θ_a)). The
//! prior of the strengths θ is independent and normal around 0; the fit is the most probable θ.
//!
//! The order of operations is fixed and functions are those of `libm`, so that published ratings have the same bits on
//! every machine. A linear algebra library would not guarantee that, since it selects instructions by the CPU.

use super::trial_counts::TrialCounts;

/// Tolerance of the strengths, a millionth of a rating point.
const TOLERANCE: f64 = 1e-9;
/// Newton's method needs fewer than ten steps; the bound guarantees termination.
const MAX_STEPS: usize = 200;

/// The trials of a pool, by pair of submissions.
#[derive(Debug, Clone)]
pub(super) struct Model {
    submissions: usize,
    /// Each pair of submissions once, with the number of trials that each side won.
    pairs: Vec<([usize; 2], [f64; 2])>,
    prior_precision: f64,
}

impl Model {
    /// `trials_per_count` is the number of trials per count of [`TrialCounts`]: ½ for half games, 1 for goals.
    pub(super) fn new<'a>(
        submissions: usize,
        trial_counts: impl Iterator<Item = &'a TrialCounts>,
        trials_per_count: f64,
        prior_sd: f64,
    ) -> Self {
        let mut won = vec![0_u64; submissions * submissions];
        for counts in trial_counts {
            let [a, b] = counts.sides;
            won[a * submissions + b] += u64::from(counts.won[0]);
            won[b * submissions + a] += u64::from(counts.won[1]);
        }
        let mut pairs = Vec::new();
        for a in 0..submissions {
            for b in a + 1..submissions {
                let counts = [won[a * submissions + b], won[b * submissions + a]];
                if counts != [0, 0] {
                    pairs.push(([a, b], counts.map(|count| trials_per_count * count as f64)));
                }
            }
        }
        Self {
            submissions,
            pairs,
            prior_precision: 1.0 / (prior_sd * prior_sd),
        }
    }

    /// The most probable strengths, by Newton's method from `start`. The maximum is unique, since the logarithm of the
    /// posterior is strictly concave.
    pub(super) fn fit(&self, start: &[f64]) -> Vec<f64> {
        let mut strengths = start.to_vec();
        let mut log_posterior = self.log_posterior(&strengths);
        for _ in 0..MAX_STEPS {
            let step = self.newton_step(&strengths);
            if step.iter().all(|change| change.abs() < TOLERANCE) {
                break;
            }
            // Far from the maximum a full step may decrease the posterior by more than rounding errors.
            let lowest_allowed = log_posterior - 1e-12 * log_posterior.abs();
            let mut scale = 1.0;
            let (moved, moved_log_posterior) = loop {
                let moved: Vec<f64> = strengths
                    .iter()
                    .zip(&step)
                    .map(|(strength, change)| strength + scale * change)
                    .collect();
                let moved_log_posterior = self.log_posterior(&moved);
                if moved_log_posterior >= lowest_allowed || scale < 1e-6 {
                    break (moved, moved_log_posterior);
                }
                scale /= 2.0;
            };
            (strengths, log_posterior) = (moved, moved_log_posterior);
        }
        strengths
    }

    fn log_posterior(&self, strengths: &[f64]) -> f64 {
        let mut sum = 0.0;
        for ([a, b], [won_a, won_b]) in &self.pairs {
            let difference = strengths[*a] - strengths[*b];
            sum -= won_a * log1p_exp(-difference) + won_b * log1p_exp(difference);
        }
        let squares: f64 = strengths.iter().map(|strength| strength * strength).sum();
        sum - self.prior_precision / 2.0 * squares
    }

    /// The step of Newton's method: the gradient of the log posterior, divided by its curvature.
    fn newton_step(&self, strengths: &[f64]) -> Vec<f64> {
        let n = self.submissions;
        let mut gradient: Vec<f64> = strengths
            .iter()
            .map(|strength| -self.prior_precision * strength)
            .collect();
        // Negative second derivatives, of which only the lower triangle is used, row by row.
        let mut curvature = vec![0.0; n * n];
        for i in 0..n {
            curvature[i * n + i] = self.prior_precision;
        }
        for ([a, b], [won_a, won_b]) in &self.pairs {
            let trials = won_a + won_b;
            let expected = 1.0 / (1.0 + libm::exp(strengths[*b] - strengths[*a]));
            let surplus = won_a - trials * expected;
            gradient[*a] += surplus;
            gradient[*b] -= surplus;
            let information = trials * expected * (1.0 - expected);
            curvature[a * n + a] += information;
            curvature[b * n + b] += information;
            curvature[b * n + a] -= information;
        }
        solve(&mut curvature, gradient)
    }
}

/// ln(1 + eˣ) without overflow.
fn log1p_exp(x: f64) -> f64 {
    x.max(0.0) + libm::log1p(libm::exp(-x.abs()))
}

/// Solves `matrix · x = right_side` by Cholesky decomposition of the lower triangle. The matrix is positive definite, as a
/// sum of the prior's diagonal and of a positive semidefinite term for each pair.
fn solve(matrix: &mut [f64], right_side: Vec<f64>) -> Vec<f64> {
    let n = right_side.len();
    for row in 0..n {
        for column in 0..=row {
            let mut remainder = matrix[row * n + column];
            for k in 0..column {
                remainder -= matrix[row * n + k] * matrix[column * n + k];
            }
            matrix[row * n + column] = if row == column {
                remainder.sqrt()
            } else {
                remainder / matrix[column * n + column]
            };
        }
    }
    // Forward substitution with the triangle, then backward substitution with its transpose, in place.
    let mut x = right_side;
    for row in 0..n {
        for k in 0..row {
            x[row] -= matrix[row * n + k] * x[k];
        }
        x[row] /= matrix[row * n + row];
    }
    for row in (0..n).rev() {
        for k in row + 1..n {
            x[row] -= matrix[k * n + row] * x[k];
        }
        x[row] /= matrix[row * n + row];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fitted(submissions: usize, trial_counts: &[TrialCounts], prior_sd: f64) -> Vec<f64> {
        Model::new(submissions, trial_counts.iter(), 1.0, prior_sd).fit(&vec![0.0; submissions])
    }

    /// With a flat prior the odds of two sides are the ratio of their wins.
    #[test]
    fn strengths_match_odds_of_wins_with_flat_prior() {
        let strengths = fitted(2, &[TrialCounts::new([0, 1], [30, 10])], 1e4);
        assert!((strengths[0] - strengths[1] - 3f64.ln()).abs() < 1e-6);
        assert!((strengths[0] + strengths[1]).abs() < 1e-9, "around zero");
    }

    #[test]
    fn unbeaten_strength_is_finite_and_unplayed_strength_is_prior() {
        let strengths = fitted(3, &[TrialCounts::new([0, 1], [1_000_000, 0])], 2.0);
        assert!(strengths[0] > 3.0 && strengths[0] < 30.0, "{strengths:?}");
        assert_eq!(strengths[2], 0.0);
    }

    proptest! {
        /// At the maximum the slope is zero: each side won as many trials as its strength predicts, minus the effect
        /// of the prior.
        #[test]
        fn fit_is_the_maximum(
            won in proptest::collection::vec([0u32..2000, 0u32..2000], 10),
            prior_sd in 0.1..10.0f64,
        ) {
            let pairs = (0..5).flat_map(|a| (a + 1..5).map(move |b| [a, b]));
            let trial_counts: Vec<_> = pairs
                .zip(won)
                .map(|(sides, won)| TrialCounts::new(sides, won))
                .collect();
            let strengths = fitted(5, &trial_counts, prior_sd);
            for side in 0..5 {
                let mut slope = -strengths[side] / (prior_sd * prior_sd);
                for counts in &trial_counts {
                    let [a, b] = counts.sides;
                    let [won_a, won_b] = counts.won.map(f64::from);
                    let expected = (won_a + won_b) / (1.0 + (strengths[b] - strengths[a]).exp());
                    if side == a { slope += won_a - expected; }
                    if side == b { slope -= won_a - expected; }
                }
                prop_assert!(slope.abs() < 1e-4, "{slope} of {strengths:?}");
            }
        }
    }
}
