//! Splits an agent's CPU time into time before a question and time between question and answer.

use crate::config::AgentEnvironment;
use std::time::{Duration, Instant};

/// A shorter gap between an answer and the next question is not measured. Reading the clock would cost more than a
/// quick agent's answer, and no agent can compute much in this time.
const MIN_GAP: Duration = Duration::from_micros(100);

/// CPU time of an agent's whole process tree at its questions and answers, in seconds; `None` if the host does not
/// report it.
#[derive(Debug)]
pub(crate) struct CpuUsage {
    /// At the last answer.
    answered_s: Option<f64>,
    answered_at: Instant,
    /// At the last question.
    asked_s: Option<f64>,
    /// At the answer before the last question.
    before_s: Option<f64>,
    /// Number of CPUs that it can use at the same time. `None` without CPU accounting by a cgroup: summing up the
    /// processes costs too much.
    cpus: Option<f64>,
}

impl CpuUsage {
    /// Starts for an agent that has used `now_s`.
    pub fn new(now_s: Option<f64>, env: &AgentEnvironment) -> Self {
        Self {
            answered_s: now_s,
            answered_at: Instant::now(),
            asked_s: now_s,
            before_s: now_s,
            cpus: env.has_cpu_accounting().then_some(env.limits.cpus),
        }
    }

    /// Records a question at `asked`. Returns the CPU time since the last answer, capped at the maximum that the agent
    /// can have used until `asked`. `read` reads the CPU clock; the call may be later than `asked`.
    pub fn record_question(
        &mut self,
        asked: Instant,
        read: impl FnOnce() -> Option<f64>,
    ) -> Duration {
        let gap = asked.saturating_duration_since(self.answered_at);
        self.before_s = self.answered_s;
        let Some(cpus) = self.cpus.filter(|_| gap >= MIN_GAP) else {
            self.asked_s = self.answered_s;
            return Duration::ZERO;
        };
        self.asked_s = read();
        used(self.answered_s, self.asked_s)
            .map(|used_s| Duration::from_secs_f64(used_s).min(gap.mul_f64(cpus)))
            .unwrap_or_default()
    }

    /// Records an answer at `at`.
    pub fn record_answer(&mut self, at: Instant, now_s: Option<f64>) {
        self.answered_s = now_s;
        self.answered_at = at;
    }

    /// CPU time since the last question, in seconds.
    pub fn since_question_s(&self, now_s: Option<f64>) -> Option<f64> {
        used(self.asked_s, now_s)
    }

    /// CPU time since the answer before the last question, in seconds.
    pub fn since_answer_s(&self, now_s: Option<f64>) -> Option<f64> {
        used(self.before_s, now_s)
    }
}

fn used(before_s: Option<f64>, now_s: Option<f64>) -> Option<f64> {
    Some((now_s? - before_s?).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cpu_usage(cpus: Option<f64>) -> CpuUsage {
        CpuUsage {
            answered_s: Some(1.0),
            answered_at: Instant::now(),
            asked_s: Some(1.0),
            before_s: Some(1.0),
            cpus,
        }
    }

    const MS: fn(u64) -> Duration = Duration::from_millis;

    #[test]
    fn cpu_time_between_answer_and_question_is_measured() {
        let mut cpu = cpu_usage(Some(2.0));
        let asked = cpu.answered_at + MS(10);
        let close = |a: Duration, b: Duration| a.abs_diff(b) < Duration::from_micros(1);
        assert!(close(cpu.record_question(asked, || Some(1.007)), MS(7)));
        let now_s = Some(1.009);
        assert!((cpu.since_question_s(now_s).unwrap() - 0.002).abs() < 1e-9);
        assert!((cpu.since_answer_s(now_s).unwrap() - 0.009).abs() < 1e-9);
        cpu.record_answer(asked + MS(5), now_s);
        // Time that the kernel charges late cannot have been used within the gap.
        let asked = cpu.answered_at + MS(1);
        assert!(close(cpu.record_question(asked, || Some(1.5)), MS(2)));
    }

    #[test]
    fn short_gaps_and_unknown_clocks_count_as_zero() {
        let mut cpu = cpu_usage(Some(2.0));
        let soon = cpu.answered_at + Duration::from_micros(50);
        assert_eq!(
            cpu.record_question(soon, || panic!("not read")),
            Duration::ZERO
        );
        let later = cpu.answered_at + MS(10);
        assert_eq!(cpu.record_question(later, || None), Duration::ZERO);
        assert_eq!(
            cpu_usage(None).record_question(later, || panic!("not read")),
            Duration::ZERO
        );
    }
}
