//! Tiers: how safe an agent is, by its *deployability score*, the sum of its penalty points in one task or game. An agent is deployable,
//! improvable or non-deployable; the bounds grow with the number of episodes or, in a game, of windows of 500 control steps. Over several
//! tasks the largest score and the worst tier count, not a sum.

use faceoff_types::{Millionths, Tier, TierBounds};

/// Highest mean penalty per episode of a deployable agent, in points (paper on the 2023 Robot Air Hockey Challenge, §2.2: 500 per 1000
/// episodes of the qualifying stage, 45 per 90 windows of a game).
pub const DEPLOYABLE_POINTS_PER_EPISODE: f64 = 0.5;
/// Highest mean penalty per episode of an improvable agent, in points (paper §2.2: 1500 per 1000 and 135 per 90).
pub const IMPROVABLE_POINTS_PER_EPISODE: f64 = 1.5;
/// These bounds, which a stage may change.
pub const TIER_BOUNDS: TierBounds =
    TierBounds::constant(Millionths::new(500_000), Millionths::new(1_500_000));

/// The tier of a deployability score over a number of episodes, or of a game's windows of 500 steps, with the ruleset's
/// bounds.
///
/// A score equal to a bound is in the better tier. Without episodes the tier is deployable.
#[must_use]
pub fn tier_of(penalty_points: f64, episodes: u32) -> Tier {
    tier_with_bounds(&TIER_BOUNDS, penalty_points, episodes)
}

/// As [`tier_of`], with other bounds.
#[must_use]
pub fn tier_with_bounds(bounds: &TierBounds, penalty_points: f64, episodes: u32) -> Tier {
    let episodes = f64::from(episodes);
    if penalty_points <= bounds.deployable().as_f64() * episodes {
        Tier::Deployable
    } else if penalty_points <= bounds.improvable().as_f64() * episodes {
        Tier::Improvable
    } else {
        Tier::NonDeployable
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Tier::{Deployable, Improvable, NonDeployable};

    #[test]
    fn bounds_of_the_paper_belong_to_better_tier() {
        for (points, episodes, tier) in [
            (500.0, 1000, Deployable),
            (500.5, 1000, Improvable),
            (1500.0, 1000, Improvable),
            (1500.5, 1000, NonDeployable),
            (45.0, 90, Deployable),
            (45.5, 90, Improvable),
            (135.0, 90, Improvable),
            (135.5, 90, NonDeployable),
        ] {
            assert_eq!(tier_of(points, episodes), tier, "{points} over {episodes}");
        }
    }

    #[test]
    fn custom_bounds_replace_those_of_the_paper() {
        let bounds = TIER_BOUNDS;
        assert_eq!(bounds.deployable().as_f64(), DEPLOYABLE_POINTS_PER_EPISODE);
        assert_eq!(bounds.improvable().as_f64(), IMPROVABLE_POINTS_PER_EPISODE);
        let strict: TierBounds = "0.1,0.2".parse().unwrap();
        for (points, tier) in [
            (10.0, Deployable),
            (10.5, Improvable),
            (20.0, Improvable),
            (20.5, NonDeployable),
        ] {
            assert_eq!(tier_with_bounds(&strict, points, 100), tier, "{points}");
        }
    }

    #[test]
    fn bounds_scale_with_number_of_episodes() {
        assert_eq!(tier_of(25.0, 50), Deployable);
        assert_eq!(tier_of(25.5, 50), Improvable);
        assert_eq!(tier_of(75.5, 50), NonDeployable);
        assert_eq!(tier_of(0.0, 0), Deployable);
    }
}
