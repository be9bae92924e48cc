//! Lower bounds of host interference, derived from two readings of the counters.

use super::reading::CpuReading;
use crate::{
    cpu_counters::ticks,
    thread_waits::{AnswerState, WaitLedger},
};
use std::time::Duration;

/// Derives interference from pairs of readings.
pub(super) struct InterferenceEstimator<'a> {
    /// The counters include all processes, in nanoseconds.
    pub precise: bool,
    pub ledger: &'a WaitLedger,
    pub answer: AnswerState,
}

impl InterferenceEstimator<'_> {
    /// The longest countable wait of one of the agent's threads; `None` if the kernel has no such counters.
    fn longest_wait(&self, from: &CpuReading, to: &CpuReading, wall: Duration) -> Option<Duration> {
        let (from, to) = (from.waits.as_ref()?, to.waits.as_ref()?);
        Some(to.longest_since(from, wall, self.ledger, self.answer))
    }

    /// Time in which other processes provably occupied all of the agent's CPUs at once.
    pub fn others_time(&self, from: &CpuReading, to: &CpuReading) -> Duration {
        let wall = to.at.saturating_duration_since(from.at);
        let agent = to.agent.saturating_sub(from.agent);
        let (mut busy, mut idle, mut stolen) = (0, 0, 0);
        for (from, to) in from.ticks.iter().zip(&to.ticks) {
            // A counter that advanced by n ticks has counted more than n - 1 and less than n + 1.
            let at_least = |from: u64, to: u64| to.saturating_sub(from).saturating_sub(1);
            busy += std::iter::zip(from.busy, to.busy)
                .map(|(from, to)| at_least(from, to))
                .sum::<u64>();
            idle += std::iter::zip(from.idle, to.idle)
                .map(|(from, to)| to.saturating_sub(from) + 1)
                .sum::<u64>();
            stolen += at_least(from.stolen, to.stolen);
        }
        // A sleeping thread is not delayed, even by steal time. Only time in which a thread ran, seemed to run, or
        // waited to run can count.
        let wait = self.longest_wait(from, to, wall).unwrap_or(wall);
        let cpus = u32::try_from(to.ticks.len()).unwrap_or(u32::MAX);
        let (busy, idle, stolen) = (ticks(busy), ticks(idle), ticks(stolen));
        let others = if self.precise {
            // Kernels differ in whether steal time also counts as run time of a process: it must not count twice.
            to.all
                .saturating_sub(from.all)
                .saturating_sub(agent)
                .max(stolen)
        } else {
            // Ticks are samples: an agent that runs only at each tick would look like other processes. Then most of
            // the time is idle, so the idle time bounds the result.
            (busy + stolen)
                .min((wall * cpus).saturating_sub(idle))
                .saturating_sub(agent)
        };
        // Explains late answers in the log.
        tracing::debug!(
            ?wall,
            ?others,
            ?agent,
            ?stolen,
            ?wait,
            from = ?from.ticks,
            to = ?to.ticks,
            "counters of host interference"
        );
        others
            .saturating_sub(wall * cpus.saturating_sub(1))
            .saturating_sub(to.throttled.saturating_sub(from.throttled))
            .min(stolen.min(wait + agent).saturating_add(wait))
            .min(wall)
    }

    /// Run delay by counters that do not lag. On a single CPU: the wait of one of the agent's threads, less the run
    /// time of all its threads. In any case: the steal time while a thread ran, seemed to run, or waited to run. An
    /// agent can cause neither, and a sleeping agent has no run delay.
    pub fn run_delay(&self, from: &CpuReading, to: &CpuReading) -> Duration {
        if !self.precise {
            return Duration::ZERO;
        }
        let wall = to.at.saturating_duration_since(from.at);
        let wait = match &to.ticks[..] {
            [_] => self.longest_wait(from, to, wall).unwrap_or_default(),
            _ => Duration::ZERO,
        };
        let ran = to.agent.saturating_sub(from.agent);
        let stolen = stolen_time(from, to).min(wait + ran);
        wait.saturating_sub(ran)
            .saturating_sub(to.throttled.saturating_sub(from.throttled))
            .max(stolen)
            .min(wall)
    }
}

/// Upper bound of interference: run time of other processes plus steal time on all CPUs, less the time in which the
/// agent's own quota throttled it.
pub(super) fn upper_bound(from: &CpuReading, to: &CpuReading, precise: bool) -> Duration {
    let (mut busy, mut stolen) = (0, 0);
    for (from, to) in from.ticks.iter().zip(&to.ticks) {
        let each = std::iter::zip(from.busy, to.busy);
        busy += each.map(|(from, to)| to.saturating_sub(from)).sum::<u64>();
        stolen += to.stolen.saturating_sub(from.stolen);
    }
    let all = if precise {
        to.all.saturating_sub(from.all)
    } else {
        ticks(busy)
    };
    all.saturating_sub(to.agent.saturating_sub(from.agent))
        .saturating_add(ticks(stolen))
        .saturating_sub(to.throttled.saturating_sub(from.throttled))
}

/// Steal time, without correction for the rounding of ticks. Of several CPUs the smallest counts: at least that CPU
/// was available for the rest of the time.
pub(super) fn stolen_time(from: &CpuReading, to: &CpuReading) -> Duration {
    let each = std::iter::zip(&from.ticks, &to.ticks);
    let stolen = each.map(|(from, to)| to.stolen.saturating_sub(from.stolen));
    ticks(stolen.min().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CpuSamples, cpu_counters::Ticks, thread_waits::ThreadWaits};
    use std::time::Instant;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// An estimator for a pending answer, without earlier samples.
    const fn estimator(precise: bool) -> InterferenceEstimator<'static> {
        static NONE: WaitLedger = WaitLedger::NONE;
        InterferenceEstimator {
            precise,
            ledger: &NONE,
            answer: AnswerState::Pending,
        }
    }

    fn reading(at: Instant, agent: u64, all: u64, ticks: &[Ticks]) -> CpuReading {
        CpuReading {
            at,
            agent: MS(agent),
            clocks: MS(agent),
            all: MS(all),
            throttled: Duration::ZERO,
            ticks: ticks.to_vec(),
            waits: None,
        }
    }

    fn cpu(busy: u64, idle: u64, stolen: u64) -> Ticks {
        Ticks {
            busy: [busy, 0, 0],
            idle: [idle, 0],
            stolen,
        }
    }

    #[test]
    fn interference_excludes_the_agent_and_is_capped() {
        let begun = Instant::now();
        let others_time = |agent: u64, all: u64, ticks: &[Ticks], wall: u64| {
            let zero = vec![Ticks::default(); ticks.len()];
            let from = reading(begun, 500, 700, &zero);
            let to = reading(begun + MS(wall), 500 + agent, 700 + all, ticks);
            estimator(true).others_time(&from, &to)
        };
        let one = [cpu(0, 0, 0)];
        assert_eq!(others_time(0, 60, &one, 100), MS(60));
        assert_eq!(
            others_time(40, 100, &one, 100),
            MS(60),
            "less its own run time"
        );
        assert_eq!(
            others_time(90, 90, &one, 100),
            MS(0),
            "its own threads do not count"
        );
        assert_eq!(
            others_time(0, 0, &one, 100),
            MS(0),
            "it slept, or its timers fired"
        );
        assert_eq!(
            others_time(0, 250, &one, 100),
            MS(100),
            "run time before the span does not count"
        );
        assert_eq!(
            others_time(0, 0, &[cpu(0, 0, 8)], 100),
            MS(70),
            "steal time"
        );
        assert_eq!(
            others_time(0, 60, &[cpu(0, 0, 5)], 100),
            MS(60),
            "and is not counted twice"
        );
        // Of two CPUs, at least one was free for the rest of the time.
        let two = [cpu(0, 0, 0); 2];
        assert_eq!(others_time(0, 100, &two, 100), MS(0));
        assert_eq!(others_time(0, 170, &two, 100), MS(70));
    }

    #[test]
    fn run_delay_on_one_cpu_excludes_the_agents_own_threads() {
        let begun = Instant::now();
        let run_delay = |agent: u64, wait: u64, ticks: &[Ticks]| {
            let zero = vec![Ticks::default(); ticks.len()];
            let mut from = reading(begun, 500, 700, &zero);
            let mut to = reading(begun + MS(30), 500 + agent, 700, ticks);
            from.waits = Some(ThreadWaits::one_thread(MS(400), MS(10)));
            to.waits = Some(ThreadWaits::one_thread(MS(401), MS(10 + wait)));
            estimator(true).run_delay(&from, &to)
        };
        let one = [cpu(0, 0, 0)];
        assert_eq!(run_delay(1, 26, &one), MS(25));
        assert_eq!(run_delay(30, 29, &one), MS(0), "its other threads ran");
        assert_eq!(run_delay(1, 0, &one), MS(0), "it slept");
        assert_eq!(
            run_delay(1, 26, &[cpu(0, 0, 0); 2]),
            MS(0),
            "another was free"
        );
        assert_eq!(
            run_delay(25, 0, &[cpu(0, 0, 2)]),
            MS(20),
            "steal time while it seemed to run"
        );
        assert_eq!(
            run_delay(1, 0, &[cpu(0, 0, 2)]),
            MS(1),
            "it slept in between"
        );
        assert_eq!(
            run_delay(20, 25, &[cpu(0, 0, 9)]),
            MS(30),
            "never more than all"
        );
        assert_eq!(run_delay(1, 0, &[cpu(0, 0, 2), cpu(0, 0, 0)]), MS(0));
        let mut from = reading(begun, 500, 700, &one);
        let mut to = reading(begun + MS(250), 501, 700, &[cpu(0, 0, 15)]);
        from.waits = Some(ThreadWaits::one_thread(MS(400), MS(10)));
        to.waits = from.waits.clone();
        assert_eq!(
            estimator(true).others_time(&from, &to),
            MS(1),
            "a sleeping thread is not delayed"
        );
        let zero = reading(begun, 0, 0, &one);
        assert_eq!(
            estimator(false).run_delay(&zero, &zero),
            MS(0),
            "ticks alone"
        );
    }

    #[test]
    fn observed_wait_excludes_the_agents_run_time() {
        let begun = Instant::now();
        let at = |ms, agent, slices, stolen, is_runnable| {
            let mut reading = reading(begun + MS(ms), agent, 0, &[cpu(0, 0, stolen)]);
            reading.waits = Some(ThreadWaits::one_thread_with_slices(slices, is_runnable));
            reading
        };
        let first = at(10, 3, 7, 5, true);
        let pending = |samples: &CpuSamples, now: &CpuReading| {
            let waits = now.waits.as_ref().unwrap();
            samples
                .ledger
                .longest_observed_wait(waits, AnswerState::Pending)
        };
        let observed_wait = |later: &CpuReading| {
            let mut samples = CpuSamples::begin(first.clone(), None, begun);
            samples.add(later.clone());
            pending(&samples, later)
        };
        assert_eq!(observed_wait(&at(15, 3, 7, 5, true)), MS(5));
        assert_eq!(
            observed_wait(&at(15, 5, 7, 5, true)),
            MS(3),
            "less its run time"
        );
        assert_eq!(
            observed_wait(&at(15, 9, 7, 5, true)),
            MS(0),
            "with its other threads"
        );
        assert_eq!(
            observed_wait(&at(15, 3, 8, 5, true)),
            MS(0),
            "it may have slept"
        );
        assert_eq!(observed_wait(&at(15, 3, 7, 5, false)), MS(0), "it sleeps");
        let mut throttled = at(15, 3, 7, 5, true);
        throttled.throttled = MS(4);
        assert_eq!(observed_wait(&throttled), MS(1), "its own quota");
        let mut ended = at(15, 3, 7, 5, true);
        (ended.clocks, ended.agent) = (MS(0), MS(7));
        assert_eq!(
            observed_wait(&ended),
            MS(1),
            "a process that ended ran, too"
        );

        // A baseline does not contain the states of threads.
        let baseline = at(0, 3, 7, 4, false);
        let stolen = |now: &CpuReading| {
            let samples = CpuSamples::begin(now.clone(), Some(&baseline), begun + MS(2));
            pending(&samples, now)
        };
        assert_eq!(stolen(&at(10, 3, 7, 4, true)), MS(0), "no steal time");
        assert_eq!(stolen(&at(20, 3, 7, 5, true)), MS(10));
        assert_eq!(stolen(&at(10, 3, 7, 6, true)), MS(8), "never more than all");
        assert_eq!(stolen(&at(10, 3, 7, 6, false)), MS(0), "it sleeps");
        assert_eq!(stolen(&at(10, 3, 8, 6, true)), MS(0), "it ran");
    }

    #[test]
    fn upper_bound_is_other_run_time_plus_steal_time() {
        let begun = Instant::now();
        let zero = [Ticks::default(); 2];
        let from = reading(begun, 500, 700, &zero);
        let mut to = reading(begun + MS(100), 520, 750, &[cpu(4, 0, 1), cpu(0, 0, 2)]);
        assert_eq!(upper_bound(&from, &to, true), MS(30 + 30));
        assert_eq!(upper_bound(&from, &to, false), MS(20 + 30));
        to.throttled = MS(45);
        assert_eq!(
            upper_bound(&from, &to, true),
            MS(15),
            "its own quota does not count"
        );
        assert_eq!(upper_bound(&from, &from, true), MS(0));
    }

    #[test]
    fn throttling_by_the_own_quota_is_subtracted() {
        let begun = Instant::now();
        let from = reading(begun, 0, 0, &[cpu(0, 0, 0)]);
        let mut to = reading(begun + MS(100), 10, 90, &[cpu(0, 0, 0)]);
        to.throttled = MS(50);
        assert_eq!(estimator(true).others_time(&from, &to), MS(30));
    }

    #[test]
    fn tick_rounding_never_favours_the_agent() {
        let begun = Instant::now();
        let others_time = |agent, ticks| {
            let from = reading(begun, 0, 0, &[cpu(0, 0, 0)]);
            let to = reading(begun + MS(200), agent, 0, &[ticks]);
            estimator(false).others_time(&from, &to)
        };
        assert_eq!(others_time(0, cpu(20, 0, 0)), MS(180));
        assert_eq!(others_time(50, cpu(20, 0, 0)), MS(130));
        assert_eq!(
            others_time(0, cpu(1, 18, 0)),
            MS(0),
            "a tick proves nothing"
        );
        assert_eq!(others_time(0, cpu(10, 0, 10)), MS(180), "steal counts");
        // It runs at each tick and sleeps in between, which counts as idle.
        assert_eq!(others_time(20, cpu(20, 17, 0)), MS(0));
        // Its timers' interrupts came while the CPU was idle: no tick shows run time of a process.
        assert_eq!(others_time(1, cpu(1, 2, 0)), MS(0));
    }
}
