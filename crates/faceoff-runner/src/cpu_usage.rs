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
    cpu_at_answer_s: Option<f64>,
    answered_at: Instant,
    /// At the last question.
    cpu_at_question_s: Option<f64>,
    /// At the answer before the last question.
    cpu_at_earlier_answer_s: Option<f64>,
    /// Number of CPUs that the agent can use at the same time. `None` without CPU accounting by a cgroup; then the CPU
    /// time before a question is not measured, since summing up the processes costs too much.
    max_cpus: Option<f64>,
}

impl CpuUsage {
    /// Starts for an agent that has used `cpu_time_s` so far.
    pub fn new(cpu_time_s: Option<f64>, env: &AgentEnvironment) -> Self {
        Self {
            cpu_at_answer_s: cpu_time_s,
            answered_at: Instant::now(),
            cpu_at_question_s: cpu_time_s,
            cpu_at_earlier_answer_s: cpu_time_s,
            max_cpus: env.has_cpu_accounting().then_some(env.limits.cpus),
        }
    }

    /// Records a question at `asked_at`. Returns the CPU time since the last answer, capped at the maximum that the agent
    /// can have used until `asked_at`. `read_cpu_time_s` reads the agent's CPU time, maybe later than `asked_at`.
    pub fn record_question(
        &mut self,
        asked_at: Instant,
        read_cpu_time_s: impl FnOnce() -> Option<f64>,
    ) -> Duration {
        let gap = asked_at.saturating_duration_since(self.answered_at);
        self.cpu_at_earlier_answer_s = self.cpu_at_answer_s;
        let Some(max_cpus) = self.max_cpus.filter(|_| gap >= MIN_GAP) else {
            self.cpu_at_question_s = self.cpu_at_answer_s;
            return Duration::ZERO;
        };
        self.cpu_at_question_s = read_cpu_time_s();
        difference_s(self.cpu_at_answer_s, self.cpu_at_question_s)
            .map(|used_s| Duration::from_secs_f64(used_s).min(gap.mul_f64(max_cpus)))
            .unwrap_or_default()
    }

    /// Records an answer at `answered_at`.
    pub fn record_answer(&mut self, answered_at: Instant, cpu_time_s: Option<f64>) {
        self.cpu_at_answer_s = cpu_time_s;
        self.answered_at = answered_at;
    }

    /// CPU time since the last question, in seconds.
    pub fn since_question_s(&self, cpu_time_s: Option<f64>) -> Option<f64> {
        difference_s(self.cpu_at_question_s, cpu_time_s)
    }

    /// CPU time since the answer before the last question, in seconds.
    pub fn since_earlier_answer_s(&self, cpu_time_s: Option<f64>) -> Option<f64> {
        difference_s(self.cpu_at_earlier_answer_s, cpu_time_s)
    }
}

fn difference_s(earlier_s: Option<f64>, later_s: Option<f64>) -> Option<f64> {
    Some((later_s? - earlier_s?).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cpu_usage(max_cpus: Option<f64>) -> CpuUsage {
        CpuUsage {
            cpu_at_answer_s: Some(1.0),
            answered_at: Instant::now(),
            cpu_at_question_s: Some(1.0),
            cpu_at_earlier_answer_s: Some(1.0),
            max_cpus,
        }
    }

    /// `MS(5)` is 5 milliseconds.
    const MS: fn(u64) -> Duration = Duration::from_millis;

    #[test]
    fn cpu_time_between_answer_and_question_is_measured() {
        let mut cpu = cpu_usage(Some(2.0));
        let asked_at = cpu.answered_at + MS(10);
        let is_close = |a: Duration, b: Duration| a.abs_diff(b) < Duration::from_micros(1);
        assert!(is_close(
            cpu.record_question(asked_at, || Some(1.007)),
            MS(7)
        ));
        let cpu_time_s = Some(1.009);
        assert!((cpu.since_question_s(cpu_time_s).unwrap() - 0.002).abs() < 1e-9);
        assert!((cpu.since_earlier_answer_s(cpu_time_s).unwrap() - 0.009).abs() < 1e-9);
        cpu.record_answer(asked_at + MS(5), cpu_time_s);
        // Time that the kernel charges late cannot have been used within the gap.
        let asked_at = cpu.answered_at + MS(1);
        assert!(is_close(cpu.record_question(asked_at, || Some(1.5)), MS(2)));
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
