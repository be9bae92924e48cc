use faceoff_types::{Tier, TierBounds};

/// A deployable agent collects at most this many penalty points per episode on average (paper §2.2:
/// 500 per 1000 episodes of the qualifying stage, 45 per 90 windows of a game).
pub const DEPLOYABLE_POINTS_PER_EPISODE: f64 = 0.5;
/// An improvable agent collects at most this many (paper §2.2: 1500 per 1000 and 135 per 90).
pub const IMPROVABLE_POINTS_PER_EPISODE: f64 = 1.5;

/// The tier of a deployability score over a number of episodes, or of a game's windows of 500 steps, by the ruleset's
/// bounds.
///
/// The bounds belong to the better tier. Nothing played, nothing violated: deployable.
#[must_use]
pub fn tier_of(penalty_points: f64, episodes: u32) -> Tier {
    tier_within(&TierBounds::default(), penalty_points, episodes)
}

/// As [`tier_of`], by other bounds.
#[must_use]
pub fn tier_within(bounds: &TierBounds, penalty_points: f64, episodes: u32) -> Tier {
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
    fn the_bounds_of_the_paper_belong_to_the_better_tier() {
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
    fn the_default_bounds_are_the_papers_and_others_are_others() {
        let bounds = TierBounds::default();
        assert_eq!(bounds.deployable().as_f64(), DEPLOYABLE_POINTS_PER_EPISODE);
        assert_eq!(bounds.improvable().as_f64(), IMPROVABLE_POINTS_PER_EPISODE);
        let strict: TierBounds = "0.1,0.2".parse().unwrap();
        for (points, tier) in [
            (10.0, Deployable),
            (10.5, Improvable),
            (20.0, Improvable),
            (20.5, NonDeployable),
        ] {
            assert_eq!(tier_within(&strict, points, 100), tier, "{points}");
        }
    }

    #[test]
    fn the_bounds_scale_with_the_number_of_episodes() {
        assert_eq!(tier_of(25.0, 50), Deployable);
        assert_eq!(tier_of(25.5, 50), Improvable);
        assert_eq!(tier_of(75.5, 50), NonDeployable);
        assert_eq!(tier_of(0.0, 0), Deployable);
    }
}
