//! *Host interference* in the time of an answer: the part in which the agent was ready to run, but the host let others
//! run. It is as much as the kernel's counters prove, and is determined for late answers only. Before an answer is
//! late, only a baseline (the counters before the question) is read, which costs a few microseconds.

use faceoff_sandbox::{CounterBaseline, CpuReading, CpuSamples, EvaluatorCounters};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// After this time the counters are sampled. In this module such an answer is called late; by the rules an answer is late only
/// after 20 ms, the control step. The time is half of the shortest one that costs points. It is also the maximum lag of the
/// kernel's counters, so that everything that a sample counts happened after the question.
pub(crate) const LATE_AFTER: Duration = Duration::from_millis(10);
/// Interval at which the evaluator wakes while an answer is late, so that its own lateness can be measured.
pub(crate) const SAMPLE_INTERVAL: Duration = Duration::from_millis(5);
/// Maximum age of the baseline. Its age is subtracted from what it proves; together with the counters' lag this is
/// less than what costs points.
pub(crate) const BASELINE_MAX_AGE: Duration = Duration::from_millis(5);
/// An evaluator that wakes late by at most this was not delayed.
const NORMAL_LATENESS: Duration = Duration::from_millis(1);
/// Host interference extends a hard limit up to this multiple of the limit; after that, the missing answer is
/// attributed to the host.
pub(crate) const MAX_EXTENSION: u32 = 4;

/// Determines host interference from the counters; tests use other implementations.
pub trait InterferenceMonitor: std::fmt::Debug + Sync {
    /// Host interference between `asked_at` and `now`. `proven`: the interference that the kernel's counters prove; `None`
    /// if there are no counters.
    fn interference(&self, asked_at: Instant, now: Instant, proven: Option<Duration>) -> Duration;
}

/// Exactly the interference that the kernel's counters prove.
#[derive(Debug, Clone, Copy)]
pub struct KernelCounters;

impl InterferenceMonitor for KernelCounters {
    fn interference(&self, _: Instant, _: Instant, proven: Option<Duration>) -> Duration {
        proven.unwrap_or_default()
    }
}

/// A wait for an answer, with the measurements of host interference.
#[derive(Debug, Clone)]
pub(crate) struct AnswerWait {
    /// Start of the counted time.
    pub asked_at: Instant,
    limit: Duration,
    /// The counters before the question, at most [`BASELINE_MAX_AGE`] older.
    baseline: Option<Arc<CounterBaseline>>,
    /// Delay of the evaluator while it wrote the question.
    write_delay: Duration,
    /// Set once the answer is late. The inner value is `None` if the host has no counters.
    late_samples: Option<Option<CpuSamples>>,
    /// Time that the evaluator spent on another agent since the last check that found no answer.
    absence: Duration,
    /// Next wake-up of the evaluator.
    pub wake_at: Instant,
    /// End of the limit, including extensions.
    pub deadline: Instant,
}

/// Counter results for a wait so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaitCounters {
    pub now: Instant,
    /// Time in which the agent was runnable and could not run; `None` if the host has no counters.
    pub run_delay: Option<Duration>,
    /// Steal time: no process ran, even if a kernel counts it as run time.
    pub stolen: Duration,
    /// Run time of the agent since the question.
    pub agent_run_time: Option<Duration>,
    /// Run delay of the evaluator since shortly before the question; `None` if it shares CPUs with the agent.
    pub evaluator_run_delay: Option<Duration>,
}

impl AnswerWait {
    /// Starts a wait whose limit runs from `asked_at`. `written_at` is the time at which the non-blocking write of the
    /// question returned.
    pub fn begin(
        baseline: Option<Arc<CounterBaseline>>,
        asked_at: Instant,
        written_at: Instant,
        limit: Duration,
    ) -> Self {
        let deadline = asked_at + limit;
        Self {
            asked_at,
            limit,
            baseline,
            write_delay: lateness(asked_at, written_at),
            late_samples: None,
            absence: Duration::ZERO,
            wake_at: (asked_at + LATE_AFTER).min(deadline),
            deadline,
        }
    }

    /// Is the answer late, so that host interference is determined, or did the evaluator wake late?
    pub fn is_late(&self, now: Instant) -> bool {
        self.late_samples.is_some() || now > self.wake_at + NORMAL_LATENESS
    }

    /// Is the next sample the first since the question?
    pub fn is_first_sample(&self) -> bool {
        self.late_samples.is_none()
    }

    /// Adds a sample of the counters of a late answer.
    pub fn add_sample(&mut self, reading: Option<CpuReading>) {
        match (&mut self.late_samples, reading) {
            (None, reading) => {
                let begin = |now| CpuSamples::begin(now, self.cpu_baseline(), self.asked_at);
                self.late_samples = Some(reading.map(begin));
            }
            (Some(Some(samples)), Some(reading)) => samples.add(reading),
            (Some(_), _) => {}
        }
    }

    /// Counters of the agent's CPUs before the question.
    pub fn cpu_baseline(&self) -> Option<&CpuReading> {
        self.baseline.as_ref()?.cpus.as_ref()
    }

    /// Counters of the evaluator's own thread before the question.
    pub fn evaluator_baseline(&self) -> Option<&EvaluatorCounters> {
        self.baseline.as_ref()?.evaluator.as_ref()
    }

    /// Samples of the counters since the answer is late.
    pub fn samples(&self) -> Option<&CpuSamples> {
        self.late_samples.as_ref()?.as_ref()
    }

    /// Adds time in which the evaluator could not check for an answer.
    pub fn add_absence(&mut self, absence: Duration) {
        self.absence += absence;
    }

    /// The evaluator checked and found no answer, so its earlier absence has delayed nothing.
    pub fn clear_absence(&mut self) {
        self.absence = Duration::ZERO;
    }

    /// Schedules the next wake-up, after a check without an answer.
    pub fn schedule_wake(&mut self, now: Instant) {
        self.wake_at = (now + SAMPLE_INTERVAL).min(self.deadline);
    }

    /// Host interference in the wait until now.
    pub fn interference(
        &self,
        monitor: &dyn InterferenceMonitor,
        counters: WaitCounters,
    ) -> Duration {
        let WaitCounters {
            now,
            run_delay,
            stolen,
            agent_run_time,
            evaluator_run_delay,
        } = counters;
        let wall = now.saturating_duration_since(self.asked_at);
        // An answer that was available when the evaluator woke late may have arrived at any time since the scheduled
        // wake-up. A question whose writing was delayed may have arrived late. The agent is not charged for these
        // delays as far as the evaluator was runnable and could not run, on CPUs that the agent cannot use. All other
        // delays of the evaluator's calls count, since the agent may have caused them.
        let evaluator_delay = match (run_delay, evaluator_run_delay) {
            (Some(_), Some(delay)) => delay.min(self.write_delay + lateness(self.wake_at, now)),
            _ => Duration::ZERO,
        };
        let ran = agent_run_time.map_or(wall, |ran| ran.min(wall.saturating_sub(stolen)));
        let proven = run_delay
            .map(|run_delay| run_delay + evaluator_delay)
            // While the agent ran, it was not delayed.
            .map(|proven| proven.min(wall.saturating_sub(ran)));
        // The evaluator's time with another agent is never charged to this one, whether or not they share CPUs. But
        // while this agent ran, it had not answered yet.
        let max_absence = wall.saturating_sub(agent_run_time.unwrap_or_default());
        monitor
            .interference(self.asked_at, now, proven)
            .max(self.absence.min(max_absence))
            .min(wall)
    }

    /// Called when the limit has passed: extends it by the host interference, or returns the cause of the timeout.
    pub fn extend(&mut self, now: Instant, interference: Duration) -> Extension {
        let agent_time = now
            .saturating_duration_since(self.asked_at)
            .saturating_sub(interference);
        if agent_time >= self.limit {
            return Extension::AgentTimeout;
        }
        let latest_end = self.asked_at + self.limit * (1 + MAX_EXTENSION);
        if now >= latest_end {
            return Extension::HostTimeout;
        }
        self.deadline = (now + (self.limit - agent_time)).min(latest_end);
        self.schedule_wake(now);
        Extension::Extended
    }
}

/// Lateness of the evaluator; zero if it is within the normal range.
fn lateness(due_at: Instant, now: Instant) -> Duration {
    let late = now.saturating_duration_since(due_at);
    if late > NORMAL_LATENESS {
        late
    } else {
        Duration::ZERO
    }
}

/// Result of extending a limit that has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extension {
    Extended,
    /// The agent exceeded its limit.
    AgentTimeout,
    /// Host interference explains the missing answer.
    HostTimeout,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `MS(5)` is 5 milliseconds.
    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// The counters of a wait: how long others ran on the agent's CPUs, and how long the agent ran. The evaluator's run
    /// delay is long if it has separate CPUs, and unknown otherwise.
    fn counters(
        now: Instant,
        others_ms: u64,
        agent_ms: u64,
        has_separate_cpus: bool,
    ) -> WaitCounters {
        WaitCounters {
            now,
            run_delay: Some(MS(others_ms)),
            stolen: Duration::ZERO,
            agent_run_time: Some(MS(agent_ms)),
            evaluator_run_delay: has_separate_cpus.then_some(MS(1000)),
        }
    }

    #[test]
    fn agents_run_time_is_never_host_interference() {
        let asked_at = Instant::now();
        let wait = AnswerWait::begin(None, asked_at, asked_at, MS(1000));
        let interference = |others_ms, agent_ms| {
            wait.interference(
                &KernelCounters,
                counters(asked_at + MS(10), others_ms, agent_ms, false),
            )
        };
        assert_eq!(interference(4, 1), MS(4));
        assert_eq!(interference(9, 8), MS(2));
        assert_eq!(interference(9, 30), MS(0), "several threads");
        let unknown = WaitCounters {
            agent_run_time: None,
            ..counters(asked_at + MS(10), 9, 0, true)
        };
        assert_eq!(wait.interference(&KernelCounters, unknown), MS(0));
        let stolen = WaitCounters {
            stolen: MS(9),
            ..counters(asked_at + MS(10), 9, 5, false)
        };
        assert_eq!(
            wait.interference(&KernelCounters, stolen),
            MS(9),
            "steal time is not run time, even if a kernel counts it"
        );
        let without_counters = WaitCounters {
            run_delay: None,
            ..counters(asked_at + MS(80), 0, 0, true)
        };
        assert_eq!(
            wait.interference(&KernelCounters, without_counters),
            MS(0),
            "no interference without a cgroup"
        );
    }

    #[test]
    fn late_wake_on_separate_cpus_is_host_interference() {
        let asked_at = Instant::now();
        let mut wait = AnswerWait::begin(None, asked_at, asked_at, MS(1000));
        let interference = |wait: &AnswerWait, waited_ms, has_separate_cpus| {
            wait.interference(
                &KernelCounters,
                counters(asked_at + MS(waited_ms), 0, 1, has_separate_cpus),
            )
        };
        assert_eq!(interference(&wait, 9, true), MS(0));
        assert_eq!(interference(&wait, 11, true), MS(0), "normal lateness");
        assert_eq!(interference(&wait, 60, true), MS(50));
        assert_eq!(
            interference(&wait, 60, false),
            MS(0),
            "the agent may have caused it"
        );
        // The evaluator found no answer at 12 ms, so only its later delay counts.
        wait.schedule_wake(asked_at + MS(12));
        assert_eq!(interference(&wait, 60, true), MS(43));
    }

    #[test]
    fn delayed_write_on_separate_cpus_is_host_interference() {
        let asked_at = Instant::now();
        let interference = |written_at, waited_ms, has_separate_cpus| {
            let mut wait = AnswerWait::begin(None, asked_at, asked_at + MS(written_at), MS(1000));
            // The first check finds no answer.
            wait.schedule_wake(asked_at + MS(written_at));
            wait.interference(
                &KernelCounters,
                counters(asked_at + MS(waited_ms), 0, 1, has_separate_cpus),
            )
        };
        assert_eq!(interference(40, 42, true), MS(40));
        assert_eq!(interference(40, 42, false), MS(0), "the agent may have run");
        assert_eq!(interference(1, 12, true), MS(6), "normal lateness");
        assert_eq!(
            interference(40, 41, true),
            MS(40),
            "without the agent's run time"
        );
    }

    #[test]
    fn evaluator_delay_is_capped_by_its_run_delay() {
        let asked_at = Instant::now();
        let wait = AnswerWait::begin(None, asked_at, asked_at + MS(5000), MS(1000));
        let interference = |run_delay_ms| {
            let counters = WaitCounters {
                evaluator_run_delay: Some(MS(run_delay_ms)),
                ..counters(asked_at + MS(5001), 0, 1, true)
            };
            wait.interference(&KernelCounters, counters)
        };
        assert_eq!(
            interference(0),
            MS(0),
            "something else delayed the evaluator's call"
        );
        assert_eq!(interference(30), MS(30));
    }

    #[test]
    fn absence_of_the_evaluator_is_not_charged() {
        let asked_at = Instant::now();
        let mut wait = AnswerWait::begin(None, asked_at, asked_at, MS(1000));
        let interference = |wait: &AnswerWait, waited_ms, agent_ms| {
            wait.interference(
                &KernelCounters,
                counters(asked_at + MS(waited_ms), 0, agent_ms, false),
            )
        };
        wait.add_absence(MS(500));
        assert_eq!(
            interference(&wait, 510, 1),
            MS(500),
            "the answer may have waited all the time"
        );
        assert_eq!(
            interference(&wait, 510, 300),
            MS(210),
            "without the agent's run time"
        );
        assert_eq!(
            interference(&wait, 400, 1),
            MS(399),
            "at most the whole wait"
        );
        wait.clear_absence();
        assert_eq!(
            interference(&wait, 510, 1),
            MS(0),
            "no answer was available"
        );
    }

    #[test]
    fn limit_is_extended_by_interference_up_to_a_maximum() {
        let asked_at = Instant::now();
        let instant = |ms| asked_at + MS(ms);
        let mut wait = AnswerWait::begin(None, asked_at, asked_at, MS(1000));
        assert_eq!((wait.wake_at, wait.deadline), (instant(10), instant(1000)));
        assert_eq!(wait.extend(instant(1000), MS(0)), Extension::AgentTimeout);
        assert_eq!(wait.extend(instant(1000), MS(300)), Extension::Extended);
        assert_eq!(
            (wait.wake_at, wait.deadline),
            (instant(1005), instant(1300))
        );
        assert_eq!(wait.extend(instant(1300), MS(300)), Extension::AgentTimeout);
        assert_eq!(wait.extend(instant(4900), MS(4800)), Extension::Extended);
        assert_eq!(wait.deadline, instant(5000));
        assert_eq!(wait.extend(instant(5000), MS(4001)), Extension::HostTimeout);
        assert_eq!(
            wait.extend(instant(5000), MS(4000)),
            Extension::AgentTimeout
        );
    }
}
