//! 95 % intervals of success rates.

/// The standard normal distribution's 97.5 % point.
const Z_97_5: f64 = 1.959_963_984_540_054;

/// The 95 % Wilson score interval of a success rate, as fractions; [0, 1] without episodes.
///
/// Unlike the normal approximation it stays within 0 and 1 and is valid near them: with no success in 50 episodes the
/// upper bound is 7 %.
#[must_use]
pub fn wilson95(successes: u32, episodes: u32) -> [f64; 2] {
    if episodes == 0 {
        return [0.0, 1.0];
    }
    wilson95_of_rate(
        f64::from(successes.min(episodes)) / f64::from(episodes),
        episodes,
    )
}

/// [`wilson95`] of a success rate over a number of episodes, for results of which only the rate (a fraction) is published, without
/// the number of successes.
#[must_use]
pub fn wilson95_of_rate(rate: f64, episodes: u32) -> [f64; 2] {
    if episodes == 0 {
        return [0.0, 1.0];
    }
    let n = f64::from(episodes);
    let centre = rate + Z_97_5 * Z_97_5 / (2.0 * n);
    let half_width = Z_97_5 * (rate * (1.0 - rate) / n + Z_97_5 * Z_97_5 / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z_97_5 * Z_97_5 / n;
    // For rates 0 and 1 one bound is exact in theory; rounding must not change it.
    let low = if rate <= 0.0 {
        0.0
    } else {
        ((centre - half_width) / scale).max(0.0)
    };
    let high = if rate >= 1.0 {
        1.0
    } else {
        ((centre + half_width) / scale).min(1.0)
    };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The interval is the set of rates p with |s/n − p| ≤ z √(p(1−p)/n): equality holds at its bounds.
    #[test]
    fn bounds_satisfy_score_test_equality() {
        for (successes, episodes) in [(7, 50), (25, 50), (549, 1000), (1, 3)] {
            let n = f64::from(episodes);
            let rate = f64::from(successes) / n;
            for bound in wilson95(successes, episodes) {
                let deviations = (rate - bound).abs() / (bound * (1.0 - bound) / n).sqrt();
                assert!(
                    (deviations - Z_97_5).abs() < 1e-9,
                    "{successes} of {episodes}: {deviations}"
                );
            }
        }
    }

    #[test]
    fn rates_0_and_1_have_exact_bound() {
        let [low, high] = wilson95(0, 50);
        assert_eq!(low, 0.0);
        assert!((high - 0.071_35).abs() < 1e-5, "{high}");
        let [low, high] = wilson95(50, 50);
        assert!((low - 0.928_65).abs() < 1e-5, "{low}");
        assert_eq!(high, 1.0);
        assert_eq!(wilson95(0, 0), [0.0, 1.0]);
    }

    proptest! {
        #[test]
        fn interval_contains_rate_within_0_and_1(episodes in 1u32..5000, share in 0.0..=1.0f64) {
            let successes = (share * f64::from(episodes)) as u32;
            let rate = f64::from(successes) / f64::from(episodes);
            let [low, high] = wilson95(successes, episodes);
            prop_assert!(0.0 <= low && low <= rate && rate <= high && high <= 1.0);
        }
    }
}
