//! Penalty points of one episode, for violated safety limits, slow answers and agent faults (an agent that crashed or
//! answered invalidly).

use faceoff_types::{
    Competition, ComputationTime, EpisodeEnd, EpisodeOutcome, ViolationCounts, ViolationName,
    Violations,
};

/// Lowest penalty for computation time in one episode that is not 0 (paper on the 2023 Robot Air Hockey Challenge, §2.2).
pub const COMPUTATION_TIME_MIN_POINTS: f64 = 0.5;
/// Highest penalty for computation time in one episode (paper §2.2), and the penalty for an agent fault.
pub const COMPUTATION_TIME_MAX_POINTS: f64 = 2.0;
/// One control step in seconds, the time limit of an answer.
const STEP_S: f64 = 0.02;

/// Limits of the slowest answer of an episode in seconds; beyond them the penalty is 0.5, 1 and 2 points.
pub const COMPUTATION_TIME_LIMITS_S: [f64; 3] = [STEP_S, 5.0 * STEP_S, 10.0 * STEP_S];

/// Penalty points for the computation times of one episode of air hockey: 0, 0.5, 1 or 2 (reference implementation, within the
/// paper's "0.5–2 pts").
#[must_use]
pub fn computation_time_penalty(time: &ComputationTime) -> f64 {
    let points = [COMPUTATION_TIME_MIN_POINTS, COMPUTATION_TIME_MAX_POINTS];
    time_penalty(time, STEP_S, points)
}

/// Penalty points for the computation times of one episode: `least` if an answer took longer than a control step, twice `least` beyond
/// five control steps, and `most` beyond ten, or if the mean exceeds a control step.
fn time_penalty(time: &ComputationTime, step_s: f64, [least, most]: [f64; 2]) -> f64 {
    if time.max_s > 10.0 * step_s || time.mean_s > step_s {
        most
    } else if time.max_s > 5.0 * step_s {
        most.min(2.0 * least)
    } else if time.max_s > step_s {
        least
    } else {
        0.0
    }
}

/// Penalty points for the computation times of an episode, or for its agent fault; none if the competition has no limit on them.
pub(crate) fn time_or_fault_penalty(competition: &Competition, outcome: &EpisodeOutcome) -> f64 {
    let Some(limit) = competition.violation(ViolationName::COMPUTATION_TIME) else {
        return 0.0;
    };
    if has_fault(outcome) {
        limit.points[1]
    } else {
        let step_s = competition.duration_s(outcome.task, 1);
        time_penalty(&outcome.computation_time, step_s, limit.points)
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
pub fn episode_penalty(competition: &Competition, outcome: &EpisodeOutcome) -> f64 {
    competition.violation_points(&outcome.violations) + time_or_fault_penalty(competition, outcome)
}

/// For each kind of violation in `names`, the number of episodes (or windows of a game) with it. `episodes` has for each its violated
/// limits, and whether it also counts as a violation of the computation time.
pub(crate) fn violation_counts<'a>(
    names: impl Iterator<Item = ViolationName>,
    episodes: impl Iterator<Item = (&'a Violations, bool)>,
) -> ViolationCounts {
    let mut counts: ViolationCounts = names.map(|name| (name, 0)).collect();
    for (violations, is_late) in episodes {
        let late = is_late.then_some(ViolationName::COMPUTATION_TIME);
        for name in violations.violated().chain(late) {
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
}
