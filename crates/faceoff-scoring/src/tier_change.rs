//! How sure a tier is: the bootstrap over episodes.

use crate::{draws::Draws, episode::MAX_EPISODE_PENALTY, tier::tier_within};
use faceoff_types::{Task, Tier, TierBounds};
use std::collections::BTreeMap;

/// Resamples of the bootstrap: a probability near one half is then known to ±1.1 percentage points
/// (one standard error), one near the ends better.
pub const TIER_CHANGE_RESAMPLES: u32 = 2000;

/// Names the stream of draws; another way of drawing is another stream.
const STREAM: &str = "faceoff-scoring tier change bootstrap 1";

/// Points are multiples of one half, so counted in halves they are small whole numbers.
const MAX_HALVES: f64 = 2.0 * MAX_EPISODE_PENALTY;

/// Probabilities that a tier would be another one, had the agent met other episodes of the same kind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TierChange {
    pub(crate) tasks: BTreeMap<Task, f64>,
    pub(crate) overall: f64,
}

impl TierChange {
    /// From the episodes' penalty points by task.
    ///
    /// Each resample draws as many episodes of each task as were played, with replacement. The draws
    /// come from BLAKE3 keyed with the penalty points themselves, in ascending order: the same
    /// evaluation always gives the same numbers, whatever the machine, the time or the order of play.
    pub(crate) fn of(points: BTreeMap<Task, Vec<f64>>, bounds: &TierBounds) -> Self {
        let mut key = blake3::Hasher::new_derive_key(STREAM);
        let tasks: BTreeMap<Task, TaskPoints> = points
            .into_iter()
            .filter(|(_, points)| !points.is_empty())
            .map(|(task, points)| {
                let played = TaskPoints::new(&points, *bounds);
                key.update(task.as_str().as_bytes());
                key.update(&u64::from(played.episodes).to_le_bytes());
                key.update(&played.halves);
                (task, played)
            })
            .collect();
        let worst = |tiers: &mut dyn Iterator<Item = Tier>| tiers.max().unwrap_or(Tier::Deployable);
        let observed = worst(&mut tasks.values().map(|played| played.tier));

        let mut draws = Draws::new(key.finalize_xof());
        let mut changed: BTreeMap<Task, u32> = tasks.keys().map(|task| (*task, 0)).collect();
        let mut changed_overall = 0;
        for _ in 0..TIER_CHANGE_RESAMPLES {
            let tiers = tasks.iter().map(|(task, played)| {
                let tier = played.resampled(&mut draws);
                if tier != played.tier
                    && let Some(changed) = changed.get_mut(task)
                {
                    *changed += 1;
                }
                tier
            });
            // every task is drawn, also once the worst tier is known
            let tiers: Vec<Tier> = tiers.collect();
            if worst(&mut tiers.into_iter()) != observed {
                changed_overall += 1;
            }
        }
        let share = |changed: u32| f64::from(changed) / f64::from(TIER_CHANGE_RESAMPLES);
        Self {
            tasks: changed
                .into_iter()
                .map(|(task, changed)| (task, share(changed)))
                .collect(),
            overall: share(changed_overall),
        }
    }
}

/// The episodes of a task.
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

    fn resampled(&self, draws: &mut Draws) -> Tier {
        if self.halves.first() == self.halves.last() {
            // whatever is drawn, it is this one
            return self.tier;
        }
        let sum = (0..self.episodes)
            .map(|_| u64::from(self.halves[draws.below(self.episodes)]))
            .sum();
        tier_of_halves(&self.bounds, sum, self.episodes)
    }
}

fn tier_of_halves(bounds: &TierBounds, halves: u64, episodes: u32) -> Tier {
    tier_within(bounds, halves as f64 / 2.0, episodes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Binomial, DiscreteCDF};

    fn change(points: &[(Task, Vec<f64>)]) -> TierChange {
        TierChange::of(points.iter().cloned().collect(), &TierBounds::default())
    }

    /// `broken` of `episodes` cost `points`.
    fn episodes(episodes: usize, broken: usize, points: f64) -> Vec<f64> {
        (0..episodes)
            .map(|episode| if episode < broken { points } else { 0.0 })
            .collect()
    }

    /// With one kind of violation a resample's points are binomial, so the bootstrap's limit is known.
    #[test]
    fn the_bootstrap_agrees_with_the_exact_distribution() {
        // 3 points each, 1000 episodes: deployable up to 166, improvable up to 500
        for (broken, stays_low, stays_high) in [
            (160, 0, 166),
            (175, 167, 500),
            (480, 167, 500),
            (520, 501, 1000),
        ] {
            let exact = Binomial::new(broken as f64 / 1000.0, 1000).unwrap();
            let below = if stays_low == 0 {
                0.0
            } else {
                exact.cdf(stays_low - 1)
            };
            let expected = 1.0 - (exact.cdf(stays_high) - below);
            let got = change(&[(Task::Hit, episodes(1000, broken, 3.0))]).tasks[&Task::Hit];
            assert!(
                (got - expected).abs() < 0.035,
                "{broken} broken: {got}, exactly {expected}"
            );
        }
    }

    #[test]
    fn what_cannot_change_does_not() {
        let clean = change(&[(Task::Hit, vec![0.0; 50]), (Task::Defend, vec![11.0; 50])]);
        assert_eq!(clean.overall, 0.0);
        assert_eq!(clean.tasks[&Task::Hit], 0.0);
        let empty = change(&[]);
        assert_eq!((empty.overall, empty.tasks.len()), (0.0, 0));
        assert_eq!(change(&[(Task::Hit, Vec::new())]).overall, 0.0);
    }

    #[test]
    fn the_worst_task_decides_overall() {
        let unsure = episodes(50, 8, 3.0); // 24 of 25 points
        let alone = change(&[(Task::Hit, unsure.clone())]);
        assert!((0.2..0.6).contains(&alone.overall), "{alone:?}");
        assert_eq!(alone.overall, alone.tasks[&Task::Hit]);
        let beside_a_bad_one = change(&[(Task::Hit, unsure), (Task::Defend, vec![11.0; 50])]);
        assert_eq!(beside_a_bad_one.overall, 0.0);
        assert!(beside_a_bad_one.tasks[&Task::Hit] > 0.2);
    }

    #[test]
    fn the_same_points_in_any_order_give_the_same_number() {
        let points = episodes(50, 8, 3.0);
        let mut reversed = points.clone();
        reversed.reverse();
        let expected = change(&[(Task::Hit, points)]);
        assert_eq!(change(&[(Task::Hit, reversed)]), expected);
        // pinned: published numbers must not change with the machine or the compiler
        assert_eq!(expected.overall, 0.4025);
    }
}
