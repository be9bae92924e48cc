use faceoff_types::{
    EvaluationResult, Profile, Ruleset, Seed, Task, TaskResult, TaskWeights, Tier, Variation,
};
use std::collections::BTreeMap;

/// What a task's success rate weighs in the overall score, in percent.
pub(crate) fn weight_percent(weights: &TaskWeights, task: Task) -> f64 {
    f64::from(weights.of(task).count()) / 1e4
}

/// The overall score in percent, from success rates as fractions. A task that is not given counts 0.
///
/// The paper's text speaks of a mean; the ruleset's weights are those that its qualifying table follows. Rounded to nine
/// decimals, so that scores that are equal on paper are equal in the computer too and a board's ties are decided by the
/// rules, not by rounding errors.
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
/// A task that was not played counts as 0 in the score. With no task at all the result is empty: score
/// 0, no penalty, deployable.
#[must_use]
pub fn score_evaluation(
    ruleset: Ruleset,
    profile: Profile,
    seed: Seed,
    variation: &Variation,
    tasks: BTreeMap<Task, TaskResult>,
) -> EvaluationResult {
    EvaluationResult {
        ruleset: ruleset.to_string(),
        profile,
        seed,
        score: overall_score(
            &variation.weights,
            tasks
                .iter()
                .map(|(task, result)| (*task, result.success_rate)),
        ),
        penalty_points: tasks
            .values()
            .map(|result| result.penalty_points)
            .fold(0.0, f64::max),
        tier: tasks
            .values()
            .map(|result| result.tier)
            .max()
            .unwrap_or(Tier::Deployable),
        tasks,
        timing: None,
        variation: variation.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_agent_scores_100_whatever_the_weights() {
        for weights in ["0.4,0.4,0.2", "0.333333,0.333333,0.333334", "1,0,0"] {
            let weights: TaskWeights = weights.parse().unwrap();
            assert_eq!(
                overall_score(&weights, Task::ALL.map(|task| (task, 1.0))),
                100.0
            );
        }
        let defends: TaskWeights = "0,1,0".parse().unwrap();
        let rates = [(Task::Hit, 0.9), (Task::Defend, 0.25)];
        assert_eq!(overall_score(&defends, rates), 25.0);
    }

    #[test]
    fn scores_that_are_equal_on_paper_are_equal() {
        let score =
            |rates| overall_score(&TaskWeights::default(), Task::ALL.into_iter().zip(rates));
        let (one, other) = (score([0.1, 0.2, 0.3]), score([0.3, 0.1, 0.1]));
        assert_eq!((one, other), (18.0, 18.0));
    }
}
