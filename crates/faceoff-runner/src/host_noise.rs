//! Whose fault was a slow answer? The host's only if three things hold: the answer came late, the
//! agent's processes used little CPU time meanwhile, and the host is seen to have stalled for what the
//! answer was late. An agent that computes fails the second, one that sleeps the third.

use faceoff_scoring::{COMPUTATION_TIME_LIMITS_S, computation_time_penalty};
use faceoff_types::ComputationTime;

/// Less than this share of the limit is “well below” it.
const LITTLE: f64 = 0.5;

/// The wait for an answer, and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AnswerWait {
    /// Wall time, seconds.
    pub wall_s: f64,
    /// CPU time of the agent's process tree, seconds, if the host tells.
    pub cpu_s: Option<f64>,
    /// For how much of the wall time the host stalled, seconds.
    pub stalled_s: f64,
}

impl AnswerWait {
    /// Was it late at all? Cheap, so that evidence is looked for only then.
    pub fn is_late(wall_s: f64) -> bool {
        wall_s > COMPUTATION_TIME_LIMITS_S[0]
    }

    /// What the answer would have taken on a host without stalls, seconds; the wall time itself if
    /// the agent was busy, or may have been.
    pub fn without_noise_s(self) -> f64 {
        let limit = COMPUTATION_TIME_LIMITS_S
            .into_iter()
            .rev()
            .find(|limit| self.wall_s > *limit);
        match (limit, self.cpu_s) {
            (Some(limit), Some(cpu_s)) if cpu_s < LITTLE * limit => {
                (self.wall_s - self.stalled_s).max(0.0)
            }
            _ => self.wall_s,
        }
    }

    /// Was an agent that did not answer within the hard limit kept from it by the host? Nobody knows
    /// how long it would have taken, so the host must have stalled for half of the limit.
    pub fn no_answer_is_noise(self, limit_s: f64) -> bool {
        self.cpu_s.is_some_and(|cpu_s| cpu_s < LITTLE * limit_s)
            && self.stalled_s >= LITTLE * limit_s
    }
}

/// Did the host's stalls cost the agent points?
pub(crate) fn host_cost_points(
    measured: &ComputationTime,
    without_noise: &ComputationTime,
) -> bool {
    computation_time_penalty(measured) > computation_time_penalty(without_noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_episode::TimeSum;

    fn noise(wall_s: f64, cpu_s: Option<f64>, stalled_s: f64) -> bool {
        let late = AnswerWait {
            wall_s,
            cpu_s,
            stalled_s,
        };
        let among_fast_ones = |time_s| {
            let mut times = TimeSum::default();
            times.add(time_s);
            for _ in 0..41 {
                times.add(0.001);
            }
            times.summary()
        };
        host_cost_points(
            &among_fast_ones(wall_s),
            &among_fast_ones(late.without_noise_s()),
        )
    }

    #[test]
    fn a_late_answer_is_noise_only_with_little_cpu_time_and_a_stall_for_the_difference() {
        assert!(noise(0.06, Some(0.002), 0.055));
        assert!(!noise(0.06, Some(0.002), 0.0), "it slept");
        assert!(!noise(0.06, Some(0.002), 0.035), "late without the stall");
        assert!(!noise(0.06, Some(0.010), 0.055), "it was busy");
        assert!(!noise(0.06, None, 0.055), "nobody knows");
        assert!(!noise(0.02, Some(0.0), 0.02), "in time");
    }

    #[test]
    fn a_stall_that_made_a_slow_answer_slower_is_noise_if_it_cost_more_points() {
        // 0.5 points by itself, 1 or 2 with the stall
        assert!(noise(0.15, Some(0.04), 0.08));
        assert!(!noise(0.15, Some(0.04), 0.04), "over 0.1 s by itself");
        assert!(noise(0.25, Some(0.09), 0.2));
        assert!(!noise(0.25, Some(0.11), 0.2), "it was busy");
    }

    #[test]
    fn no_answer_is_noise_if_the_host_stalled_for_half_of_the_limit() {
        let none = |cpu_s, stalled_s| {
            AnswerWait {
                wall_s: 1.0,
                cpu_s,
                stalled_s,
            }
            .no_answer_is_noise(1.0)
        };
        assert!(none(Some(0.1), 0.5));
        assert!(!none(Some(0.1), 0.4));
        assert!(!none(Some(0.5), 0.9));
        assert!(!none(None, 0.9));
    }
}
