//! The score of an evaluation (a team's run of all tasks) from the results of its tasks.

use faceoff_types::{
    EvaluationResult, Profile, Ruleset, Seed, Task, TaskMap, TaskResult, TaskWeights, Tier,
    TierBounds, Variation,
};

/// Weight of a task's success rate in the overall score, in percent.
pub(crate) fn weight_percent(weights: &TaskWeights, task: Task) -> f64 {
    // `count` is in millionths of the total weight.
    f64::from(weights.weight(task).count()) / 1e4
}

/// The overall score in percent, from success rates as fractions. Missing tasks count as 0.
///
/// The text of the paper on the 2023 challenge says "mean", but its qualifying table follows the weights of the ruleset. Rounding to nine
/// decimals makes mathematically equal scores equal in floating point, so that the rules decide ties, not rounding errors.
#[must_use]
pub fn overall_score(weights: &TaskWeights, rates: impl IntoIterator<Item = (Task, f64)>) -> f64 {
    let score: f64 = rates
        .into_iter()
        .map(|(task, rate)| weight_percent(weights, task) * rate)
        .sum();
    (score * 1e9).round() / 1e9
}

/// Scores an evaluation: weighted score, maximum of the tasks' penalty points, worst of their tiers.
///
/// `weights` and `bounds` are those of tasks and tiers under the stage's rules; without bounds there are no tiers. A missing task
/// counts as 0 in the score. Without any task the score is 0, the penalty 0 and the tier, if
/// there are tiers, deployable.
#[must_use]
pub fn score_evaluation(
    ruleset: Ruleset,
    profile: Profile,
    seed: Seed,
    variation: &Variation,
    weights: &TaskWeights,
    bounds: Option<TierBounds>,
    tasks: TaskMap<TaskResult>,
) -> EvaluationResult {
    EvaluationResult {
        ruleset: ruleset.to_string(),
        profile,
        seed,
        score: overall_score(
            weights,
            tasks
                .iter()
                .map(|(task, result)| (*task, result.success_rate)),
        ),
        penalty_points: tasks
            .values()
            .map(|result| result.penalty_points)
            .fold(0.0, f64::max),
        tier: bounds.map(|_| {
            tasks
                .values()
                .filter_map(|result| result.tier)
                .max()
                .unwrap_or(Tier::Deployable)
        }),
        tasks,
        timing: None,
        variation: variation.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_airhockey::{DEFEND, HIT, TASKS};

    #[test]
    fn perfect_agent_scores_100_for_all_weights() {
        for weights in ["0.4,0.4,0.2", "0.333333,0.333333,0.333334", "1,0,0"] {
            let weights = TaskWeights::parse(weights, TASKS.into_iter()).unwrap();
            assert_eq!(
                overall_score(&weights, TASKS.map(|task| (task, 1.0))),
                100.0
            );
        }
        let defend_only = TaskWeights::of(DEFEND);
        let rates = [(HIT, 0.9), (DEFEND, 0.25)];
        assert_eq!(overall_score(&defend_only, rates), 25.0);
    }

    #[test]
    fn mathematically_equal_scores_are_equal() {
        let weights = TaskWeights::parse("0.4,0.4,0.2", TASKS.into_iter()).unwrap();
        let score = |rates| overall_score(&weights, TASKS.into_iter().zip(rates));
        assert_eq!(score([0.1, 0.2, 0.3]), 18.0);
        assert_eq!(score([0.3, 0.1, 0.1]), 18.0);
    }
}
