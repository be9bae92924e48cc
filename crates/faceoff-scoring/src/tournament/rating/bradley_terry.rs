//! The Bradley–Terry model: side a wins a trial against b with probability 1 / (1 + e^(θ_b − θ_a)), with
//! strengths θ that are independent and normal around 0 beforehand. Fitted is the most probable θ.
//!
//! Written out here in one fixed order of operations, with `libm`, so that published ratings have the
//! same bits on every machine; products of matrices of the libraries choose instructions by the CPU.

use super::contest::Contest;

/// The strengths are exact to this, a millionth of a point of the rating.
const TOLERANCE: f64 = 1e-9;
/// Newton's method needs fewer than ten; a bound, so that nothing can hang.
const MAX_STEPS: usize = 200;

/// All contests of a pool, by pair.
#[derive(Debug, Clone)]
pub(super) struct Model {
    submissions: usize,
    /// Each pair once, with how many trials each side won.
    pairs: Vec<([usize; 2], [f64; 2])>,
    prior_precision: f64,
}

impl Model {
    /// `value` is the trials that one won count of a contest stands for: ½ of a half game, 1 of a goal.
    pub(super) fn new<'a>(
        submissions: usize,
        contests: impl Iterator<Item = &'a Contest>,
        value: f64,
        prior_sd: f64,
    ) -> Self {
        let mut won = vec![0_u64; submissions * submissions];
        for contest in contests {
            let [a, b] = contest.sides;
            won[a * submissions + b] += u64::from(contest.won[0]);
            won[b * submissions + a] += u64::from(contest.won[1]);
        }
        let mut pairs = Vec::new();
        for a in 0..submissions {
            for b in a + 1..submissions {
                let counts = [won[a * submissions + b], won[b * submissions + a]];
                if counts != [0, 0] {
                    pairs.push(([a, b], counts.map(|count| value * count as f64)));
                }
            }
        }
        Self {
            submissions,
            pairs,
            prior_precision: 1.0 / (prior_sd * prior_sd),
        }
    }

    /// The most probable strengths, by Newton's method from `start`. There is exactly one such point,
    /// since the logarithm of the posterior is strictly concave.
    pub(super) fn fit(&self, start: &[f64]) -> Vec<f64> {
        let mut strengths = start.to_vec();
        let mut height = self.log_posterior(&strengths);
        for _ in 0..MAX_STEPS {
            let step = self.newton_step(&strengths);
            if step.iter().all(|change| change.abs() < TOLERANCE) {
                break;
            }
            // Far from the top a whole step may lead below where it began, by more than rounding does.
            let floor = height - 1e-12 * height.abs();
            let mut scale = 1.0;
            let (moved, risen) = loop {
                let moved: Vec<f64> = strengths
                    .iter()
                    .zip(&step)
                    .map(|(strength, change)| strength + scale * change)
                    .collect();
                let risen = self.log_posterior(&moved);
                if risen >= floor || scale < 1e-6 {
                    break (moved, risen);
                }
                scale /= 2.0;
            };
            (strengths, height) = (moved, risen);
        }
        strengths
    }

    fn log_posterior(&self, strengths: &[f64]) -> f64 {
        let mut sum = 0.0;
        for ([a, b], [won_a, won_b]) in &self.pairs {
            let lead = strengths[*a] - strengths[*b];
            sum -= won_a * log1p_exp(-lead) + won_b * log1p_exp(lead);
        }
        let squares: f64 = strengths.iter().map(|strength| strength * strength).sum();
        sum - self.prior_precision / 2.0 * squares
    }

    fn newton_step(&self, strengths: &[f64]) -> Vec<f64> {
        let n = self.submissions;
        let mut gradient: Vec<f64> = strengths
            .iter()
            .map(|strength| -self.prior_precision * strength)
            .collect();
        // The negative second derivatives: the lower triangle, row by row.
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

/// Solves `matrix · x = right` by Cholesky's method. The matrix is given by its lower triangle and is
/// positive definite: a sum of the prior's diagonal and of the pairs' squares.
fn solve(matrix: &mut [f64], mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for row in 0..n {
        for column in 0..=row {
            let mut rest = matrix[row * n + column];
            for k in 0..column {
                rest -= matrix[row * n + k] * matrix[column * n + k];
            }
            matrix[row * n + column] = if row == column {
                rest.sqrt()
            } else {
                rest / matrix[column * n + column]
            };
        }
    }
    for row in 0..n {
        for k in 0..row {
            right[row] -= matrix[row * n + k] * right[k];
        }
        right[row] /= matrix[row * n + row];
    }
    for row in (0..n).rev() {
        for k in row + 1..n {
            right[row] -= matrix[k * n + row] * right[k];
        }
        right[row] /= matrix[row * n + row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fitted(submissions: usize, contests: &[Contest], prior_sd: f64) -> Vec<f64> {
        Model::new(submissions, contests.iter(), 1.0, prior_sd).fit(&vec![0.0; submissions])
    }

    /// With a flat prior two sides' odds are those of their wins.
    #[test]
    fn two_sides_have_the_odds_of_their_wins() {
        let strengths = fitted(2, &[Contest::new([0, 1], [30, 10])], 1e4);
        assert!((strengths[0] - strengths[1] - 3f64.ln()).abs() < 1e-6);
        assert!((strengths[0] + strengths[1]).abs() < 1e-9, "around zero");
    }

    #[test]
    fn who_never_lost_stays_finite_and_nobody_played_is_the_prior() {
        let strengths = fitted(3, &[Contest::new([0, 1], [1_000_000, 0])], 2.0);
        assert!(strengths[0] > 3.0 && strengths[0] < 30.0, "{strengths:?}");
        assert_eq!(strengths[2], 0.0);
    }

    proptest! {
        /// At the top the slope is zero: each side won as much as its strength expects, less the pull
        /// of the prior.
        #[test]
        fn the_fit_is_the_top(
            won in proptest::collection::vec([0u32..2000, 0u32..2000], 10),
            prior_sd in 0.1..10.0f64,
        ) {
            let pairs = (0..5).flat_map(|a| (a + 1..5).map(move |b| [a, b]));
            let contests: Vec<_> = pairs
                .zip(won)
                .map(|(sides, won)| Contest::new(sides, won))
                .collect();
            let strengths = fitted(5, &contests, prior_sd);
            for side in 0..5 {
                let mut slope = -strengths[side] / (prior_sd * prior_sd);
                for contest in &contests {
                    let [a, b] = contest.sides;
                    let [won_a, won_b] = contest.won.map(f64::from);
                    let expected = (won_a + won_b) / (1.0 + (strengths[b] - strengths[a]).exp());
                    if side == a { slope += won_a - expected; }
                    if side == b { slope -= won_a - expected; }
                }
                prop_assert!(slope.abs() < 1e-4, "{slope} of {strengths:?}");
            }
        }
    }
}
