//! The result of one task from the outcomes of its episodes.

use crate::{
    episode::{episode_penalty, has_fault, time_or_fault_penalty, violation_counts},
    interval::wilson95,
    step_times::StepTimes,
    tier::tier_with_bounds,
};
use faceoff_types::{Competition, EpisodeOutcome, TaskResult, TierBounds};

/// Scores one task from its episodes; `bounds` decide the tier; without them it has none.
///
/// `step_times` are the computation times of all answered steps in the sequence of the episodes. The result then does not
/// depend on how the episodes were divided into jobs.
///
/// An episode that ended with an agent fault is a failure and counts as a violation of the computation time, with its highest penalty.
///
/// # Panics
/// If `step_times` has more or fewer times than expected.
#[must_use]
pub fn score_task(
    competition: &Competition,
    outcomes: &[EpisodeOutcome],
    step_times: &StepTimes,
    bounds: Option<TierBounds>,
) -> TaskResult {
    let episodes = count(outcomes, |_| true);
    let successes = count(outcomes, |outcome| outcome.success && !has_fault(outcome));
    // Points are multiples of one half: the sum is exact in any order.
    let penalty_points = outcomes
        .iter()
        .map(|outcome| episode_penalty(competition, outcome))
        .sum();
    TaskResult {
        episodes,
        successes,
        success_rate: if episodes == 0 {
            0.0
        } else {
            f64::from(successes) / f64::from(episodes)
        },
        success_ci95: wilson95(successes, episodes),
        penalty_points,
        violations: violation_counts(
            competition.violations.iter().map(|info| info.name),
            outcomes.iter().map(|outcome| {
                let is_late = time_or_fault_penalty(competition, outcome) > 0.0;
                (&outcome.violations, is_late)
            }),
        ),
        tier: bounds.map(|bounds| tier_with_bounds(&bounds, penalty_points, episodes)),
        steps: outcomes
            .iter()
            .map(|outcome| u64::from(outcome.steps))
            .sum(),
        computation_time_s: step_times.summary(),
    }
}

fn count(outcomes: &[EpisodeOutcome], test: impl Fn(&EpisodeOutcome) -> bool) -> u32 {
    let count = outcomes.iter().filter(|outcome| test(outcome)).count();
    u32::try_from(count).expect("episodes are numbered with u32")
}
