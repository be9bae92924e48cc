//! Penalty points of one episode, for violated safety limits, slow answers and agent faults (an agent that crashed or
//! answered invalidly).

use faceoff_types::{
    ComputationTime, EpisodeEnd, EpisodeOutcome, ViolationCounts, ViolationName, Violations,
};

/// Penalty points for an end effector outside its bounds (paper §2.2).
pub const EE_POINTS: f64 = 3.0;
/// Penalty points for an elbow or wrist that is too low (reference implementation; not in the paper).
pub const LINK_POINTS: f64 = 3.0;
/// Penalty points for a joint beyond its position limits (paper §2.2).
pub const JOINT_POS_POINTS: f64 = 2.0;
/// Penalty points for a joint beyond its velocity limits (paper §2.2).
pub const JOINT_VEL_POINTS: f64 = 1.0;
/// Lowest penalty for computation time in one episode that is not 0 (paper §2.2).
pub const COMPUTATION_TIME_MIN_POINTS: f64 = 0.5;
/// Highest penalty for computation time in one episode (paper §2.2), and the penalty for an agent fault.
pub const COMPUTATION_TIME_MAX_POINTS: f64 = 2.0;
/// Highest penalty of one episode.
pub const MAX_EPISODE_PENALTY: f64 =
    EE_POINTS + LINK_POINTS + JOINT_POS_POINTS + JOINT_VEL_POINTS + COMPUTATION_TIME_MAX_POINTS;

/// One control step in seconds, the time limit of an answer.
const STEP_S: f64 = 0.02;

/// Limits of the slowest answer of an episode in seconds; beyond them the penalty is 0.5, 1 and 2 points.
pub const COMPUTATION_TIME_LIMITS_S: [f64; 3] = [STEP_S, 5.0 * STEP_S, 10.0 * STEP_S];

/// Penalty points for the computation times of one episode: 0, 0.5, 1 or 2 (reference implementation, within the
/// paper's "0.5–2 pts").
#[must_use]
pub fn computation_time_penalty(time: &ComputationTime) -> f64 {
    let [half_point_s, one_point_s, two_points_s] = COMPUTATION_TIME_LIMITS_S;
    if time.max_s > two_points_s || time.mean_s > STEP_S {
        COMPUTATION_TIME_MAX_POINTS
    } else if time.max_s > one_point_s {
        1.0
    } else if time.max_s > half_point_s {
        COMPUTATION_TIME_MIN_POINTS
    } else {
        0.0
    }
}

/// Penalty points for the computation times of an episode, or for its agent fault.
pub(crate) fn time_or_fault_penalty(outcome: &EpisodeOutcome) -> f64 {
    if has_fault(outcome) {
        COMPUTATION_TIME_MAX_POINTS
    } else {
        computation_time_penalty(&outcome.computation_time)
    }
}

/// Did an agent fault end the episode?
pub(crate) fn has_fault(outcome: &EpisodeOutcome) -> bool {
    outcome.fault.is_some() || outcome.end == EpisodeEnd::AGENT_FAULT
}

/// Penalty points of one episode: each kind of violation counts once, regardless of its duration.
///
/// An agent fault gives the full penalty for computation time, regardless of the earlier steps.
#[must_use]
pub fn episode_penalty(outcome: &EpisodeOutcome) -> f64 {
    violation_points(&outcome.violations) + time_or_fault_penalty(outcome)
}

/// Penalty points for constraints that the robot's motion violated.
pub(crate) fn violation_points(violations: &Violations) -> f64 {
    [
        (violations.ee, EE_POINTS),
        (violations.link, LINK_POINTS),
        (violations.joint_pos, JOINT_POS_POINTS),
        (violations.joint_vel, JOINT_VEL_POINTS),
    ]
    .into_iter()
    .filter(|(violated, _)| *violated)
    .map(|(_, points)| points)
    .sum()
}

/// For each kind of violation, the number of episodes (or windows of a game) with it. Each is given by the violated constraints, and
/// whether its answers were late.
pub(crate) fn violation_counts<'a>(
    episodes: impl Iterator<Item = (&'a Violations, bool)>,
) -> ViolationCounts {
    let late = ViolationName::COMPUTATION_TIME;
    let names = Violations::default().by_name().map(|(name, _)| (name, 0));
    let mut counts: ViolationCounts = names.into_iter().chain([(late, 0)]).collect();
    for (violations, is_late) in episodes {
        let kinds = violations.by_name().into_iter().chain([(late, is_late)]);
        for (name, _) in kinds.filter(|(_, is_violated)| *is_violated) {
            counts.set(name, counts.get(name) + 1);
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn penalty(mean_s: f64, max_s: f64) -> f64 {
        computation_time_penalty(&ComputationTime { mean_s, max_s })
    }

    #[test]
    fn computation_time_penalty_uses_maximum_and_mean() {
        assert_eq!(penalty(0.0, 0.0), 0.0);
        assert_eq!(penalty(0.001, 0.02), 0.0, "the limit itself is in time");
        assert_eq!(penalty(0.001, 0.020_000_1), 0.5);
        assert_eq!(penalty(0.001, 0.1), 0.5);
        assert_eq!(penalty(0.001, 0.100_000_1), 1.0);
        assert_eq!(penalty(0.02, 0.2), 1.0);
        assert_eq!(penalty(0.001, 0.200_000_1), 2.0);
        assert_eq!(penalty(0.020_000_1, 0.021), 2.0, "late on average");
    }

    #[test]
    fn maximum_penalty_is_sum_of_all() {
        assert_eq!(MAX_EPISODE_PENALTY, 11.0);
    }
}
