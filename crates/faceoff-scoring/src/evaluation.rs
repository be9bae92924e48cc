use faceoff_types::{EvaluationResult, Profile, Ruleset, Seed, Task, TaskResult, Tier};
use std::collections::BTreeMap;

/// What a task's success rate weighs in the overall score, in percent.
///
/// The paper's text speaks of a mean; these weights are those that its qualifying table follows.
#[must_use]
pub const fn task_weight_percent(task: Task) -> u32 {
    match task {
        Task::Hit | Task::Defend => 40,
        Task::Prepare => 20,
    }
}

/// The overall score in percent, from success rates as fractions. A task that is not given counts 0.
///
/// Rounded to nine decimals, so that scores that are equal on paper are equal in the computer too and
/// a board's ties are decided by the rules, not by rounding errors.
#[must_use]
pub fn overall_score(rates: impl IntoIterator<Item = (Task, f64)>) -> f64 {
    let score: f64 = rates
        .into_iter()
        .map(|(task, rate)| f64::from(task_weight_percent(task)) * rate)
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
    tasks: BTreeMap<Task, TaskResult>,
) -> EvaluationResult {
    EvaluationResult {
        ruleset: ruleset.to_string(),
        profile,
        seed,
        score: overall_score(
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
        variation: Default::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_agent_scores_100() {
        assert_eq!(overall_score(Task::ALL.map(|task| (task, 1.0))), 100.0);
        assert_eq!(Task::ALL.map(task_weight_percent).iter().sum::<u32>(), 100);
    }

    #[test]
    fn scores_that_are_equal_on_paper_are_equal() {
        let one = overall_score([(Task::Hit, 0.1), (Task::Defend, 0.2), (Task::Prepare, 0.3)]);
        let other = overall_score([(Task::Hit, 0.3), (Task::Defend, 0.1), (Task::Prepare, 0.1)]);
        assert_eq!((one, other), (18.0, 18.0));
    }
}
