//! The probability that an agent would get another tier on other episodes of the same kind, estimated by a bootstrap:
//! many samples of the evaluation's own episodes, drawn with replacement.

use crate::{random_numbers::RandomNumbers, tier::tier_with_bounds};
use faceoff_types::{TaskMap, Tier, TierBounds};

/// Resamples of the bootstrap: the standard error of a probability of one half is 1.1 percentage points, and smaller near
/// 0 and 1.
pub const TIER_CHANGE_RESAMPLES: u32 = 2000;

/// Identifies the stream of random draws; a change of the method needs a new name.
const STREAM: &str = "faceoff-scoring tier change bootstrap 1";

/// Highest penalty of an episode in half points that the method counts. Penalties are multiples of half a point, so in this unit they are
/// small integers.
const MAX_HALVES: f64 = u8::MAX as f64;

/// Probabilities of another tier on other episodes of the same kind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TierChange {
    pub(crate) tasks: TaskMap<f64>,
    pub(crate) overall: f64,
}

impl TierChange {
    /// Estimates the probabilities from the penalty points of each task's episodes.
    ///
    /// Each resample draws the same number of episodes of each task, with replacement. The draws come from BLAKE3 keyed
    /// with the penalty points in ascending order. The same evaluation therefore always gives the same numbers,
    /// regardless of machine, time and sequence of episodes.
    pub(crate) fn from_points(points: TaskMap<Vec<f64>>, bounds: &TierBounds) -> Self {
        let mut key = blake3::Hasher::new_derive_key(STREAM);
        let tasks: TaskMap<TaskPoints> = points
            .into_iter()
            .filter(|(_, points)| !points.is_empty())
            .map(|(task, points)| {
                let task_points = TaskPoints::new(&points, *bounds);
                key.update(task.as_str().as_bytes());
                key.update(&u64::from(task_points.episodes).to_le_bytes());
                key.update(&task_points.halves);
                (task, task_points)
            })
            .collect();
        let worst = |tiers: &mut dyn Iterator<Item = Tier>| tiers.max().unwrap_or(Tier::Deployable);
        let observed = worst(&mut tasks.values().map(|task| task.tier));

        let mut random_numbers = RandomNumbers::new(key.finalize_xof());
        let mut changed: TaskMap<u32> = tasks.keys().map(|task| (*task, 0)).collect();
        let mut changed_overall = 0;
        for _ in 0..TIER_CHANGE_RESAMPLES {
            let tiers = tasks.iter().map(|(task, task_points)| {
                let tier = task_points.resampled_tier(&mut random_numbers);
                if tier != task_points.tier
                    && let Some(count) = changed.get_mut(task)
                {
                    *count += 1;
                }
                tier
            });
            // All tasks are drawn, even if the worst tier is already known.
            let tiers: Vec<Tier> = tiers.collect();
            if worst(&mut tiers.into_iter()) != observed {
                changed_overall += 1;
            }
        }
        let share = |count: u32| f64::from(count) / f64::from(TIER_CHANGE_RESAMPLES);
        Self {
            tasks: changed
                .into_iter()
                .map(|(task, count)| (task, share(count)))
                .collect(),
            overall: share(changed_overall),
        }
    }
}

/// Penalty points of the episodes of a task.
struct TaskPoints {
    /// Half points of each episode, ascending.
    halves: Vec<u8>,
    episodes: u32,
    bounds: TierBounds,
    tier: Tier,
}

impl TaskPoints {
    fn new(points: &[f64], bounds: TierBounds) -> Self {
        let mut halves: Vec<u8> = points
            .iter()
            .map(|points| (2.0 * points).round().clamp(0.0, MAX_HALVES) as u8)
            .collect();
        halves.sort_unstable();
        let episodes = u32::try_from(halves.len()).expect("episodes are numbered with u32");
        let sum = halves.iter().map(|h| u64::from(*h)).sum();
        let tier = tier_of_halves(&bounds, sum, episodes);
        Self {
            halves,
            episodes,
            bounds,
            tier,
        }
    }

    fn resampled_tier(&self, random_numbers: &mut RandomNumbers) -> Tier {
        if self.halves.first() == self.halves.last() {
            // All episodes have the same points, so all resamples have this tier.
            return self.tier;
        }
        let sum = (0..self.episodes)
            .map(|_| u64::from(self.halves[random_numbers.below(self.episodes)]))
            .sum();
        tier_of_halves(&self.bounds, sum, self.episodes)
    }
}

fn tier_of_halves(bounds: &TierBounds, halves: u64, episodes: u32) -> Tier {
    tier_with_bounds(bounds, halves as f64 / 2.0, episodes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tier::TIER_BOUNDS;
    use faceoff_airhockey::{DEFEND, HIT};
    use faceoff_types::Task;
    use statrs::distribution::{Binomial, DiscreteCDF};

    fn change(points: &[(Task, Vec<f64>)]) -> TierChange {
        TierChange::from_points(points.iter().cloned().collect(), &TIER_BOUNDS)
    }

    /// The first `violated` of `episodes` have `points`, the others none.
    fn episodes(episodes: usize, violated: usize, points: f64) -> Vec<f64> {
        (0..episodes)
            .map(|episode| if episode < violated { points } else { 0.0 })
            .collect()
    }

    /// With one kind of violation the points of a resample are binomial, so the limit of the bootstrap is known.
    #[test]
    fn bootstrap_agrees_with_exact_distribution() {
        // With 3 points for each violated episode and 1000 episodes, the tier is deployable up to 166 violated episodes and
        // improvable up to 500. The last two numbers are the fewest and the most with the same tier as `violated`.
        for (violated, fewest, most) in [
            (160, 0, 166),
            (175, 167, 500),
            (480, 167, 500),
            (520, 501, 1000),
        ] {
            let exact = Binomial::new(violated as f64 / 1000.0, 1000).unwrap();
            let below = if fewest == 0 {
                0.0
            } else {
                exact.cdf(fewest - 1)
            };
            let expected = 1.0 - (exact.cdf(most) - below);
            let got = change(&[(HIT, episodes(1000, violated, 3.0))]).tasks[&HIT];
            assert!(
                (got - expected).abs() < 0.035,
                "{violated} violated: {got}, exactly {expected}"
            );
        }
    }

    #[test]
    fn tier_change_is_zero_for_equal_or_no_points() {
        let clean = change(&[(HIT, vec![0.0; 50]), (DEFEND, vec![11.0; 50])]);
        assert_eq!(clean.overall, 0.0);
        assert_eq!(clean.tasks[&HIT], 0.0);
        let empty = change(&[]);
        assert_eq!((empty.overall, empty.tasks.len()), (0.0, 0));
        assert_eq!(change(&[(HIT, Vec::new())]).overall, 0.0);
    }

    #[test]
    fn worst_task_decides_overall_tier_change() {
        let uncertain = episodes(50, 8, 3.0); // 24 points; deployable up to 25
        let alone = change(&[(HIT, uncertain.clone())]);
        assert!((0.2..0.6).contains(&alone.overall), "{alone:?}");
        assert_eq!(alone.overall, alone.tasks[&HIT]);
        let with_bad_task = change(&[(HIT, uncertain), (DEFEND, vec![11.0; 50])]);
        assert_eq!(with_bad_task.overall, 0.0);
        assert!(with_bad_task.tasks[&HIT] > 0.2);
    }

    #[test]
    fn tier_change_does_not_depend_on_episode_order() {
        let points = episodes(50, 8, 3.0);
        let mut reversed = points.clone();
        reversed.reverse();
        let expected = change(&[(HIT, points)]);
        assert_eq!(change(&[(HIT, reversed)]), expected);
        // pinned: published numbers must not change with the machine or the compiler
        assert_eq!(expected.overall, 0.4025);
    }
}
