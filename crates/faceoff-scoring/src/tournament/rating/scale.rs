//! The scale of ratings. A submission's *strength* is the natural logarithm of its odds; *rating points* are on the Elo scale.

/// Mean of the prior and of each pool, in rating points.
pub const MEAN_RATING: f64 = 1500.0;

/// Difference of two ratings at which the odds are ten to one (Elo scale).
pub const POINTS_PER_TENFOLD: f64 = 400.0;

/// Standard deviation of the prior around [`MEAN_RATING`], in rating points.
///
/// It is that of a new player in Glicko (M. E. Glickman, Applied Statistics 48, 1999). A dozen games outweigh it, and it
/// keeps the rating of an unbeaten side finite.
pub const PRIOR_SD: f64 = 350.0;

/// Rating points per unit of strength, the natural logarithm of the odds.
const POINTS_PER_STRENGTH: f64 = POINTS_PER_TENFOLD / std::f64::consts::LN_10;

/// Standard deviation of the prior in units of strength.
pub(super) const PRIOR_SD_STRENGTH: f64 = PRIOR_SD / POINTS_PER_STRENGTH;

pub(super) fn rating_of(strength: f64) -> f64 {
    MEAN_RATING + POINTS_PER_STRENGTH * strength
}

/// Expected share of a game, or probability of the next goal, for a rating against another one:
/// 1 / (1 + 10^((other − own) / 400)).
#[must_use]
pub fn expected_score(own: f64, other: f64) -> f64 {
    1.0 / (1.0 + libm::exp10((other - own) / POINTS_PER_TENFOLD))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn score_of_400_points_more_is_ten_to_one() {
        assert!((expected_score(1900.0, 1500.0) - 10.0 / 11.0).abs() < 1e-15);
        assert_eq!(expected_score(1500.0, 1500.0), 0.5);
        let (a, b) = (0.7, -0.4);
        let of_strengths = 1.0 / (1.0 + libm::exp(b - a));
        let of_ratings = expected_score(rating_of(a), rating_of(b));
        assert!((of_strengths - of_ratings).abs() < 1e-14);
    }
}
