//! When an agent used its CPU time: while it was waited for, or before it was asked.

use crate::config::AgentEnvironment;
use std::time::{Duration, Instant};

/// Between an answer and the next question nothing is looked up that is shorter: that would cost more than a
/// quick agent's answer, and no agent can do much in it.
const SHORTEST_GAP: Duration = Duration::from_micros(100);

/// CPU time of an agent's whole process tree in seconds, at the moments of a conversation; `None` where the host
/// does not tell.
#[derive(Debug)]
pub(crate) struct CpuUse {
    /// At the last answer, and when that was.
    answered_s: Option<f64>,
    answered_at: Instant,
    /// At the last question.
    asked_s: Option<f64>,
    /// At the answer before the last question.
    before_s: Option<f64>,
    /// As many CPUs as it can use at a time; `None` without a cgroup that counts: to add up processes costs too much.
    cpus: Option<f64>,
}

impl CpuUse {
    /// Of an agent that has used `now_s`.
    pub fn begin(now_s: Option<f64>, env: &AgentEnvironment) -> Self {
        Self {
            answered_s: now_s,
            answered_at: Instant::now(),
            asked_s: now_s,
            before_s: now_s,
            cpus: env.counts_cpus().then_some(env.limits.cpus),
        }
    }

    /// It is asked at `asked`; returns what it has used since its last answer, at most what it can have used. `read`
    /// reads the clock, and may be called after that.
    pub fn asked(&mut self, asked: Instant, read: impl FnOnce() -> Option<f64>) -> Duration {
        let gap = asked.saturating_duration_since(self.answered_at);
        self.before_s = self.answered_s;
        let Some(cpus) = self.cpus.filter(|_| gap >= SHORTEST_GAP) else {
            self.asked_s = self.answered_s;
            return Duration::ZERO;
        };
        self.asked_s = read();
        used(self.answered_s, self.asked_s)
            .map(|used_s| Duration::from_secs_f64(used_s).min(gap.mul_f64(cpus)))
            .unwrap_or_default()
    }

    /// It has answered at `at`.
    pub fn answered(&mut self, at: Instant, now_s: Option<f64>) {
        self.answered_s = now_s;
        self.answered_at = at;
    }

    /// Used since the last question, seconds.
    pub fn since_question_s(&self, now_s: Option<f64>) -> Option<f64> {
        used(self.asked_s, now_s)
    }

    /// Used since the answer before the last question, seconds.
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

    fn cpu_use(cpus: Option<f64>) -> CpuUse {
        CpuUse {
            answered_s: Some(1.0),
            answered_at: Instant::now(),
            asked_s: Some(1.0),
            before_s: Some(1.0),
            cpus,
        }
    }

    const MS: fn(u64) -> Duration = Duration::from_millis;

    #[test]
    fn time_between_answer_and_question_is_a_head_start() {
        let mut cpu = cpu_use(Some(2.0));
        let asked = cpu.answered_at + MS(10);
        let close = |a: Duration, b: Duration| a.abs_diff(b) < Duration::from_micros(1);
        assert!(close(cpu.asked(asked, || Some(1.007)), MS(7)));
        let now_s = Some(1.009);
        assert!((cpu.since_question_s(now_s).unwrap() - 0.002).abs() < 1e-9);
        assert!((cpu.since_answer_s(now_s).unwrap() - 0.009).abs() < 1e-9);
        cpu.answered(asked + MS(5), now_s);
        // What the kernel charges later cannot have been used in between.
        let asked = cpu.answered_at + MS(1);
        assert!(close(cpu.asked(asked, || Some(1.5)), MS(2)));
    }

    #[test]
    fn short_gaps_and_unknown_clocks_give_none() {
        let mut cpu = cpu_use(Some(2.0));
        let soon = cpu.answered_at + Duration::from_micros(50);
        assert_eq!(cpu.asked(soon, || panic!("not read")), Duration::ZERO);
        let later = cpu.answered_at + MS(10);
        assert_eq!(cpu.asked(later, || None), Duration::ZERO);
        assert_eq!(
            cpu_use(None).asked(later, || panic!("not read")),
            Duration::ZERO
        );
    }
}
