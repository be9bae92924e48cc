use crate::{
    episode::{episode_penalty, has_fault, time_or_fault_penalty},
    interval::wilson95,
    tier::tier_of,
};
use faceoff_types::{ComputationTimeSummary, EpisodeOutcome, TaskResult, ViolationCounts};

/// Scores one task from its episodes.
///
/// `step_times_s` are the computation times of all answered steps in seconds, in any order; they are
/// sorted in place, so that the result does not depend on how the episodes were cut into shards.
///
/// An episode that ended by an agent fault is a failure and counts as a violation of the computation
/// time.
#[must_use]
pub fn score_task(outcomes: &[EpisodeOutcome], step_times_s: &mut [f64]) -> TaskResult {
    let episodes = count(outcomes, |_| true);
    let successes = count(outcomes, |outcome| outcome.success && !has_fault(outcome));
    // Points are multiples of one half: the sum is exact in any order.
    let penalty_points = outcomes.iter().map(episode_penalty).sum();
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
        violations: ViolationCounts {
            ee: count(outcomes, |outcome| outcome.violations.ee),
            link: count(outcomes, |outcome| outcome.violations.link),
            joint_pos: count(outcomes, |outcome| outcome.violations.joint_pos),
            joint_vel: count(outcomes, |outcome| outcome.violations.joint_vel),
            computation_time: count(outcomes, |outcome| time_or_fault_penalty(outcome) > 0.0),
        },
        tier: tier_of(penalty_points, episodes),
        steps: outcomes
            .iter()
            .map(|outcome| u64::from(outcome.steps))
            .sum(),
        computation_time_s: summarise(step_times_s),
    }
}

fn count(outcomes: &[EpisodeOutcome], test: impl Fn(&EpisodeOutcome) -> bool) -> u32 {
    let count = outcomes.iter().filter(|outcome| test(outcome)).count();
    u32::try_from(count).expect("episodes are numbered with u32")
}

/// Mean, 99th percentile (nearest rank) and maximum; zeros when there was no step.
fn summarise(times_s: &mut [f64]) -> ComputationTimeSummary {
    times_s.sort_unstable_by(f64::total_cmp);
    let Some(&max) = times_s.last() else {
        return ComputationTimeSummary::default();
    };
    let rank = (times_s.len() * 99).div_ceil(100);
    ComputationTimeSummary {
        mean: times_s.iter().sum::<f64>() / times_s.len() as f64,
        p99: times_s[rank - 1],
        max,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_99th_percentile_is_the_nearest_rank() {
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let summary = summarise(&mut hundred);
        assert_eq!(
            (summary.mean, summary.p99, summary.max),
            (50.5, 99.0, 100.0)
        );
        assert_eq!(summarise(&mut [0.5]).p99, 0.5);
        assert_eq!(summarise(&mut [3.0, 1.0, 2.0]).p99, 3.0);
        assert_eq!(summarise(&mut []), ComputationTimeSummary::default());
    }
}
