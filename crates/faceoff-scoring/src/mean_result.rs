//! Means over several evaluations of one team, one for each evaluation day, for boards that rank teams over several days.

use crate::{
    evaluation::score_evaluation,
    interval::wilson95,
    summary::{EpisodeSummary, TaskSummary},
    tier::tier_with_bounds,
};
use faceoff_types::{
    ComputationTimeSummary, EvaluationResult, InvalidShortName, Ruleset, Seed, TaskMap, TaskResult,
    TaskWeights, TierBounds, ViolationCounts,
};

/// Key derivation context (BLAKE3) of the hash that represents the seeds of several days.
const SEED_CONTEXT: &str = "faceoff-scoring seeds of several days 1";

/// The mean of evaluations with the same rules, tasks and numbers of episodes; `None` if `results` is empty. Success rates
/// and penalty points are means over the evaluations; tier and score follow from them.
///
/// A task's `episodes`, `successes`, violations and steps are sums, so that its interval is that of all episodes. The mean
/// computation time is over all steps, percentile and maximum are the worst of the days. `seed` represents the seeds of
/// the evaluations in their sequence.
///
/// `weights` and `bounds` are those of tasks and tiers under the rules of the evaluations.
///
/// # Errors
/// If the name of the first evaluation's ruleset is malformed.
pub fn mean_result(
    results: &[&EvaluationResult],
    weights: &TaskWeights,
    bounds: Option<TierBounds>,
) -> Result<Option<EvaluationResult>, InvalidShortName> {
    let [first, ..] = results else {
        return Ok(None);
    };
    let ruleset: Ruleset = first.ruleset.parse()?;
    let tasks = first.tasks.keys().map(|task| {
        let days: Vec<&TaskResult> = results
            .iter()
            .filter_map(|result| result.tasks.get(task))
            .collect();
        (*task, mean_task(&days, bounds))
    });
    let tasks: TaskMap<TaskResult> = tasks.collect();
    let seed = combined_seed(results.iter().map(|result| result.seed));
    let variation = &first.variation;
    let mean = score_evaluation(
        ruleset,
        first.profile,
        seed,
        variation,
        weights,
        bounds,
        tasks,
    );
    Ok(Some(mean))
}

/// The mean of one task's results; `days` has one result for each evaluation.
fn mean_task(days: &[&TaskResult], bounds: Option<TierBounds>) -> TaskResult {
    let sum = |value: fn(&TaskResult) -> u32| -> u32 {
        days.iter()
            .fold(0, |sum, day| sum.saturating_add(value(day)))
    };
    let (episodes, successes) = (sum(|day| day.episodes), sum(|day| day.successes));
    // Points are multiples of one half: the sum is exact in any order.
    let points: f64 = days.iter().map(|day| day.penalty_points).sum();
    let steps: u64 = days.iter().map(|day| day.steps).sum();
    let worst = |value: fn(&ComputationTimeSummary) -> f64| {
        let times = days.iter().map(|day| value(&day.computation_time_s));
        times.fold(0.0, f64::max)
    };
    let total_time_s: f64 = days
        .iter()
        .map(|day| day.computation_time_s.mean * day.steps as f64)
        .sum();
    TaskResult {
        episodes,
        successes,
        success_rate: f64::from(successes) / f64::from(episodes.max(1)),
        success_ci95: wilson95(successes, episodes),
        penalty_points: points / days.len().max(1) as f64,
        violations: days
            .iter()
            .fold(ViolationCounts::default(), |mut sum, day| {
                sum.add(&day.violations);
                sum
            }),
        tier: bounds.map(|bounds| tier_with_bounds(&bounds, points, episodes)),
        steps,
        computation_time_s: ComputationTimeSummary {
            mean: total_time_s / (steps.max(1) as f64),
            p99: worst(|times| times.p99),
            max: worst(|times| times.max),
        },
    }
}

/// A hash of the seeds of several days; the seed itself for one day.
fn combined_seed(seeds: impl Iterator<Item = Seed>) -> Seed {
    let seeds: Vec<Seed> = seeds.collect();
    if let [seed] = seeds[..] {
        return seed;
    }
    let mut hash = blake3::Hasher::new_derive_key(SEED_CONTEXT);
    for seed in seeds {
        hash.update(seed.to_string().as_bytes());
    }
    Seed::from_bytes(*hash.finalize().as_bytes())
}

/// The episodes of several evaluations as those of one, in the given sequence. `tier_change`, the probability of another tier, is not
/// estimated, since that needs the outcomes of all episodes: it is 0, or absent in a competition without tiers.
#[must_use]
pub fn joined_summary(summaries: &[&EpisodeSummary]) -> EpisodeSummary {
    let mut tasks: TaskMap<Vec<&TaskSummary>> = TaskMap::new();
    for summary in summaries {
        for (task, task_summary) in &summary.tasks {
            tasks.entry(*task).or_default().push(task_summary);
        }
    }
    let tasks = tasks.into_iter().map(|(task, days)| {
        let summary = TaskSummary {
            successes: days.iter().flat_map(|day| day.successes.iter()).collect(),
            penalty_points: days.iter().map(|day| day.penalty_points).sum(),
            tier_change: days.iter().find_map(|day| day.tier_change).map(|_| 0.0),
        };
        (task, summary)
    });
    EpisodeSummary {
        tasks: tasks.collect(),
        tier_change: summaries
            .iter()
            .find_map(|summary| summary.tier_change)
            .map(|_| 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tier::{TIER_BOUNDS, tier_of};
    use faceoff_airhockey::{EE, HIT, TASKS};
    use faceoff_types::{Tier, Variation};

    fn weights() -> TaskWeights {
        TaskWeights::parse("0.4,0.4,0.2", TASKS.into_iter()).unwrap()
    }

    /// The result of an evaluation with 100 episodes of the task hit.
    fn day(seed: u64, successes: u32, penalty_points: f64) -> EvaluationResult {
        let task = TaskResult {
            episodes: 100,
            successes,
            success_rate: f64::from(successes) / 100.0,
            success_ci95: wilson95(successes, 100),
            penalty_points,
            violations: [(EE, 3)].into_iter().collect(),
            tier: Some(tier_of(penalty_points, 100)),
            steps: 1000,
            computation_time_s: ComputationTimeSummary {
                mean: 0.001 * f64::from(successes),
                p99: 0.1,
                max: 0.2,
            },
        };
        score_evaluation(
            faceoff_airhockey::RULESET,
            faceoff_airhockey::EVALUATION,
            Seed::from_number(seed),
            &Variation::default(),
            &weights(),
            Some(TIER_BOUNDS),
            [(HIT, task)].into(),
        )
    }

    fn mean_of(results: &[&EvaluationResult]) -> Option<EvaluationResult> {
        mean_result(results, &weights(), Some(TIER_BOUNDS)).unwrap()
    }

    #[test]
    fn mean_averages_rates_and_points_and_derives_tier() {
        assert_eq!(mean_of(&[]), None);
        let (a, b) = (day(1, 40, 20.0), day(2, 60, 100.0));
        let tiers = [Tier::Deployable, Tier::Improvable].map(Some);
        assert_eq!([a.tier, b.tier], tiers);
        assert_eq!(mean_of(&[&a]).unwrap(), a);
        let mean = mean_of(&[&a, &b]).unwrap();
        let hit = &mean.tasks[&HIT];
        assert_eq!(
            (hit.episodes, hit.successes, hit.success_rate),
            (200, 100, 0.5)
        );
        assert_eq!(hit.success_ci95, wilson95(100, 200));
        assert_eq!((hit.penalty_points, mean.penalty_points), (60.0, 60.0));
        assert_eq!(
            mean.tier,
            Some(Tier::Improvable),
            "60 points over 100 episodes"
        );
        assert_eq!(mean.score, 20.0);
        assert_eq!((hit.violations.get(EE), hit.steps), (6, 2000));
        assert!((hit.computation_time_s.mean - 0.05).abs() < 1e-12);
        let repetition = mean_of(&[&a, &b]).unwrap();
        assert_eq!(mean.seed, repetition.seed);
        let other_order = mean_of(&[&b, &a]).unwrap();
        assert_ne!(mean.seed, other_order.seed);
    }

    #[test]
    fn mean_without_tiers_has_no_tier() {
        let (mut a, mut b) = (day(1, 40, 20.0), day(2, 60, 100.0));
        for result in [&mut a, &mut b] {
            result.tier = None;
            result.tasks[&HIT].tier = None;
        }
        let mean = mean_result(&[&a, &b], &weights(), None).unwrap().unwrap();
        assert_eq!((mean.tier, mean.tasks[&HIT].tier), (None, None));
        assert_eq!((mean.score, mean.penalty_points), (20.0, 60.0));
    }

    #[test]
    fn joined_summary_concatenates_episodes_of_days() {
        let summary = |solved: &[bool]| EpisodeSummary {
            tasks: [(
                HIT,
                TaskSummary {
                    successes: solved.iter().copied().collect(),
                    penalty_points: 1.5,
                    tier_change: Some(0.5),
                },
            )]
            .into(),
            tier_change: Some(0.5),
        };
        let joined = joined_summary(&[&summary(&[true, false]), &summary(&[false, true])]);
        let hit = &joined.tasks[&HIT];
        assert_eq!(
            hit.successes,
            [true, false, false, true].into_iter().collect()
        );
        assert_eq!((hit.penalty_points, hit.tier_change), (3.0, Some(0.0)));
    }
}
