/// The rating of a submission of which nothing is known, and the mean of each pool.
pub const CENTRE: f64 = 1500.0;

/// A lead of so many points makes the odds of winning ten to one (Elo's scale).
pub const POINTS_PER_TENFOLD: f64 = 400.0;

/// Standard deviation of the prior, in points: before its first game a submission's strength is taken
/// to be normally distributed around [`CENTRE`] with it. It is what Glicko starts an unknown player with
/// (M. E. Glickman, Applied Statistics 48, 1999), wide enough that a dozen games outweigh it, and it
/// keeps finite what has no finite estimate by itself: a side that never lost.
pub const PRIOR_SD: f64 = 350.0;

/// Points of a strength of 1, the natural logarithm of the odds.
const POINTS_PER_STRENGTH: f64 = POINTS_PER_TENFOLD / std::f64::consts::LN_10;

/// The prior's standard deviation as a strength.
pub(super) const PRIOR_SD_STRENGTH: f64 = PRIOR_SD / POINTS_PER_STRENGTH;

pub(super) fn rating_of(strength: f64) -> f64 {
    CENTRE + POINTS_PER_STRENGTH * strength
}

/// The share of a game, or the chance of the next goal, that a rating expects against another one:
/// 1 / (1 + 10^((other − own) / 400)).
#[must_use]
pub fn expected_score(own: f64, other: f64) -> f64 {
    1.0 / (1.0 + libm::exp10((other - own) / POINTS_PER_TENFOLD))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_hundred_points_are_ten_to_one() {
        assert!((expected_score(1900.0, 1500.0) - 10.0 / 11.0).abs() < 1e-15);
        assert_eq!(expected_score(1500.0, 1500.0), 0.5);
        let (a, b) = (0.7, -0.4);
        let of_strengths = 1.0 / (1.0 + libm::exp(b - a));
        let of_ratings = expected_score(rating_of(a), rating_of(b));
        assert!((of_strengths - of_ratings).abs() < 1e-14);
    }
}
