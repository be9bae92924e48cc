//! Lower bounds of *host interference*, derived from two readings of the kernel's counters. Host interference is the time in which an
//! agent was ready to run, but other processes ran on its CPUs or the hypervisor had stopped them (*steal time*).

use super::reading::CpuReading;
use crate::{
    cpu_counters::ticks_to_duration,
    thread_waits::{AnswerState, WaitLedger},
};
use std::time::Duration;

/// Derives interference from pairs of readings.
pub(super) struct InterferenceEstimator<'a> {
    /// Do the counters include all processes, in nanoseconds? Otherwise the time of other processes is known in ticks only.
    pub is_precise: bool,
    /// The agent's threads' waits before the second reading, as samples showed them.
    pub ledger: &'a WaitLedger,
    pub answer: AnswerState,
}

impl InterferenceEstimator<'_> {
    /// The longest countable wait (for a CPU, while ready to run) of one of the agent's threads: one that may have delayed the answer.
    /// `None` if the kernel has no such counters.
    fn longest_wait(
        &self,
        earlier: &CpuReading,
        later: &CpuReading,
        wall: Duration,
    ) -> Option<Duration> {
        let (earlier, later) = (earlier.waits.as_ref()?, later.waits.as_ref()?);
        Some(later.longest_since(earlier, wall, self.ledger, self.answer))
    }

    /// Time in which other processes provably occupied all of the agent's CPUs at once.
    pub fn others_time(&self, earlier: &CpuReading, later: &CpuReading) -> Duration {
        let wall = later.read_at.saturating_duration_since(earlier.read_at);
        let agent = later.agent_run_time.saturating_sub(earlier.agent_run_time);
        let (mut busy, mut idle, mut stolen) = (0, 0, 0);
        for (earlier, later) in earlier.ticks.iter().zip(&later.ticks) {
            // A counter that advanced by n ticks has counted more than n - 1 and less than n + 1.
            let min_advance =
                |earlier: u64, later: u64| later.saturating_sub(earlier).saturating_sub(1);
            busy += std::iter::zip(earlier.busy, later.busy)
                .map(|(earlier, later)| min_advance(earlier, later))
                .sum::<u64>();
            idle += std::iter::zip(earlier.idle, later.idle)
                .map(|(earlier, later)| later.saturating_sub(earlier) + 1)
                .sum::<u64>();
            stolen += min_advance(earlier.stolen, later.stolen);
        }
        // A sleeping thread is not delayed, even by steal time. Only time in which a thread ran, seemed to run, or
        // waited to run can count.
        let wait = self.longest_wait(earlier, later, wall).unwrap_or(wall);
        let cpus = u32::try_from(later.ticks.len()).unwrap_or(u32::MAX);
        let (busy, idle, stolen) = (
            ticks_to_duration(busy),
            ticks_to_duration(idle),
            ticks_to_duration(stolen),
        );
        let others = if self.is_precise {
            // Kernels differ in whether steal time also counts as run time of a process: it must not count twice.
            later
                .total_run_time
                .saturating_sub(earlier.total_run_time)
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
            earlier = ?earlier.ticks,
            later = ?later.ticks,
            "counters of host interference"
        );
        others
            .saturating_sub(wall * cpus.saturating_sub(1))
            .saturating_sub(later.throttled.saturating_sub(earlier.throttled))
            .min(stolen.min(wait + agent).saturating_add(wait))
            .min(wall)
    }

    /// Run delay without the run time of other processes, which the kernel charges only at its next tick. On a single CPU: the wait of
    /// one of the agent's threads, less the run time of all its threads. In any case: the steal time while a thread ran, seemed to run,
    /// or waited to run. An agent can cause neither, and a sleeping agent has no run delay.
    pub fn run_delay(&self, earlier: &CpuReading, later: &CpuReading) -> Duration {
        if !self.is_precise {
            return Duration::ZERO;
        }
        let wall = later.read_at.saturating_duration_since(earlier.read_at);
        let wait = match &later.ticks[..] {
            [_] => self.longest_wait(earlier, later, wall).unwrap_or_default(),
            _ => Duration::ZERO,
        };
        let ran = later.agent_run_time.saturating_sub(earlier.agent_run_time);
        let stolen = stolen_time(earlier, later).min(wait + ran);
        wait.saturating_sub(ran)
            .saturating_sub(later.throttled.saturating_sub(earlier.throttled))
            .max(stolen)
            .min(wall)
    }
}

/// Upper bound of interference: run time of other processes plus steal time on all CPUs, less the time in which the
/// agent's own quota throttled it.
pub(super) fn upper_bound(earlier: &CpuReading, later: &CpuReading, is_precise: bool) -> Duration {
    let (mut busy, mut stolen) = (0, 0);
    for (earlier, later) in earlier.ticks.iter().zip(&later.ticks) {
        let each = std::iter::zip(earlier.busy, later.busy);
        busy += each
            .map(|(earlier, later)| later.saturating_sub(earlier))
            .sum::<u64>();
        stolen += later.stolen.saturating_sub(earlier.stolen);
    }
    let all = if is_precise {
        later.total_run_time.saturating_sub(earlier.total_run_time)
    } else {
        ticks_to_duration(busy)
    };
    all.saturating_sub(later.agent_run_time.saturating_sub(earlier.agent_run_time))
        .saturating_add(ticks_to_duration(stolen))
        .saturating_sub(later.throttled.saturating_sub(earlier.throttled))
}

/// Steal time, without correction for the rounding of ticks. Of several CPUs the smallest counts: at least that CPU
/// was available for the rest of the time.
pub(super) fn stolen_time(earlier: &CpuReading, later: &CpuReading) -> Duration {
    let each = std::iter::zip(&earlier.ticks, &later.ticks);
    let stolen = each.map(|(earlier, later)| later.stolen.saturating_sub(earlier.stolen));
    ticks_to_duration(stolen.min().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CpuSamples, cpu_counters::Ticks, thread_waits::ThreadWaits};
    use std::time::Instant;

    /// `MS(5)` is 5 milliseconds.
    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// An estimator for a pending answer, without earlier samples.
    const fn estimator(is_precise: bool) -> InterferenceEstimator<'static> {
        static EMPTY: WaitLedger = WaitLedger::EMPTY;
        InterferenceEstimator {
            is_precise,
            ledger: &EMPTY,
            answer: AnswerState::Pending,
        }
    }

    /// A reading with the run times of the agent and of all processes, in milliseconds. The agent's time by its cgroup
    /// (`agent_run_time`) and that by the clocks of its processes (`agent_clock_time`) are equal.
    fn reading(read_at: Instant, agent: u64, all: u64, ticks: &[Ticks]) -> CpuReading {
        CpuReading {
            read_at,
            agent_run_time: MS(agent),
            agent_clock_time: MS(agent),
            total_run_time: MS(all),
            throttled: Duration::ZERO,
            ticks: ticks.to_vec(),
            waits: None,
        }
    }

    /// Counters of one CPU, in ticks of 10 ms.
    fn cpu(busy: u64, idle: u64, stolen: u64) -> Ticks {
        Ticks {
            busy: [busy, 0, 0],
            idle: [idle, 0],
            stolen,
        }
    }

    #[test]
    fn interference_excludes_the_agent_and_is_capped() {
        let start = Instant::now();
        let others_time = |agent: u64, all: u64, ticks: &[Ticks], wall: u64| {
            let zero_ticks = vec![Ticks::default(); ticks.len()];
            let earlier = reading(start, 500, 700, &zero_ticks);
            let later = reading(start + MS(wall), 500 + agent, 700 + all, ticks);
            estimator(true).others_time(&earlier, &later)
        };
        let one_cpu = [cpu(0, 0, 0)];
        assert_eq!(others_time(0, 60, &one_cpu, 100), MS(60));
        assert_eq!(
            others_time(40, 100, &one_cpu, 100),
            MS(60),
            "without the agent's own run time"
        );
        assert_eq!(
            others_time(90, 90, &one_cpu, 100),
            MS(0),
            "the agent's own threads do not count"
        );
        assert_eq!(
            others_time(0, 0, &one_cpu, 100),
            MS(0),
            "the agent slept, or its timers fired"
        );
        assert_eq!(
            others_time(0, 250, &one_cpu, 100),
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
            "steal time is not counted twice"
        );
        // Of two CPUs, at least one was free for the rest of the time.
        let two_cpus = [cpu(0, 0, 0); 2];
        assert_eq!(others_time(0, 100, &two_cpus, 100), MS(0));
        assert_eq!(others_time(0, 170, &two_cpus, 100), MS(70));
    }

    #[test]
    fn run_delay_on_one_cpu_excludes_the_agents_own_threads() {
        let start = Instant::now();
        let run_delay = |agent: u64, wait: u64, ticks: &[Ticks]| {
            let zero_ticks = vec![Ticks::default(); ticks.len()];
            let mut earlier = reading(start, 500, 700, &zero_ticks);
            let mut later = reading(start + MS(30), 500 + agent, 700, ticks);
            earlier.waits = Some(ThreadWaits::one_thread(MS(400), MS(10)));
            later.waits = Some(ThreadWaits::one_thread(MS(401), MS(10 + wait)));
            estimator(true).run_delay(&earlier, &later)
        };
        let one_cpu = [cpu(0, 0, 0)];
        assert_eq!(run_delay(1, 26, &one_cpu), MS(25));
        assert_eq!(
            run_delay(30, 29, &one_cpu),
            MS(0),
            "the agent's other threads ran"
        );
        assert_eq!(run_delay(1, 0, &one_cpu), MS(0), "the agent slept");
        assert_eq!(
            run_delay(1, 26, &[cpu(0, 0, 0); 2]),
            MS(0),
            "the other CPU was free"
        );
        assert_eq!(
            run_delay(25, 0, &[cpu(0, 0, 2)]),
            MS(20),
            "steal time while the agent seemed to run"
        );
        assert_eq!(
            run_delay(1, 0, &[cpu(0, 0, 2)]),
            MS(1),
            "the agent slept in between"
        );
        assert_eq!(
            run_delay(20, 25, &[cpu(0, 0, 9)]),
            MS(30),
            "never more than the whole time"
        );
        assert_eq!(run_delay(1, 0, &[cpu(0, 0, 2), cpu(0, 0, 0)]), MS(0));
        let mut earlier = reading(start, 500, 700, &one_cpu);
        let mut later = reading(start + MS(250), 501, 700, &[cpu(0, 0, 15)]);
        earlier.waits = Some(ThreadWaits::one_thread(MS(400), MS(10)));
        later.waits = earlier.waits.clone();
        assert_eq!(
            estimator(true).others_time(&earlier, &later),
            MS(1),
            "a sleeping thread is not delayed"
        );
        let zero_ticks = reading(start, 0, 0, &one_cpu);
        assert_eq!(
            estimator(false).run_delay(&zero_ticks, &zero_ticks),
            MS(0),
            "ticks do not show it"
        );
    }

    #[test]
    fn observed_wait_excludes_the_agents_run_time() {
        let start = Instant::now();
        let reading_at = |ms, agent, time_slices, stolen, is_runnable| {
            let mut reading = reading(start + MS(ms), agent, 0, &[cpu(0, 0, stolen)]);
            reading.waits = Some(ThreadWaits::one_thread_with_slices(
                time_slices,
                is_runnable,
            ));
            reading
        };
        let first = reading_at(10, 3, 7, 5, true);
        let pending = |samples: &CpuSamples, now: &CpuReading| {
            let waits = now.waits.as_ref().unwrap();
            samples
                .ledger
                .longest_observed_wait(waits, AnswerState::Pending)
        };
        let observed_wait = |later: &CpuReading| {
            let mut samples = CpuSamples::begin(first.clone(), None, start);
            samples.add(later.clone());
            pending(&samples, later)
        };
        assert_eq!(observed_wait(&reading_at(15, 3, 7, 5, true)), MS(5));
        assert_eq!(
            observed_wait(&reading_at(15, 5, 7, 5, true)),
            MS(3),
            "without the agent's run time"
        );
        assert_eq!(
            observed_wait(&reading_at(15, 9, 7, 5, true)),
            MS(0),
            "nor the run time of its other threads"
        );
        assert_eq!(
            observed_wait(&reading_at(15, 3, 8, 5, true)),
            MS(0),
            "the thread may have slept"
        );
        assert_eq!(
            observed_wait(&reading_at(15, 3, 7, 5, false)),
            MS(0),
            "the thread sleeps"
        );
        let mut throttled = reading_at(15, 3, 7, 5, true);
        throttled.throttled = MS(4);
        assert_eq!(
            observed_wait(&throttled),
            MS(1),
            "without the throttling by its own quota"
        );
        // The clocks of processes miss a process that has ended; the cgroup's counter does not.
        let mut ended = reading_at(15, 3, 7, 5, true);
        (ended.agent_clock_time, ended.agent_run_time) = (MS(0), MS(7));
        assert_eq!(
            observed_wait(&ended),
            MS(1),
            "a process that ended ran, too"
        );

        // A baseline, a quick reading before the question, does not contain the states of threads.
        let baseline = reading_at(0, 3, 7, 4, false);
        let stolen = |now: &CpuReading| {
            let samples = CpuSamples::begin(now.clone(), Some(&baseline), start + MS(2));
            pending(&samples, now)
        };
        assert_eq!(
            stolen(&reading_at(10, 3, 7, 4, true)),
            MS(0),
            "no steal time"
        );
        assert_eq!(stolen(&reading_at(20, 3, 7, 5, true)), MS(10));
        assert_eq!(
            stolen(&reading_at(10, 3, 7, 6, true)),
            MS(8),
            "never more than the whole time"
        );
        assert_eq!(
            stolen(&reading_at(10, 3, 7, 6, false)),
            MS(0),
            "the thread sleeps"
        );
        assert_eq!(
            stolen(&reading_at(10, 3, 8, 6, true)),
            MS(0),
            "the thread ran"
        );
    }

    #[test]
    fn upper_bound_is_other_run_time_plus_steal_time() {
        let start = Instant::now();
        let zero_ticks = [Ticks::default(); 2];
        let earlier = reading(start, 500, 700, &zero_ticks);
        let mut later = reading(start + MS(100), 520, 750, &[cpu(4, 0, 1), cpu(0, 0, 2)]);
        assert_eq!(upper_bound(&earlier, &later, true), MS(30 + 30));
        assert_eq!(upper_bound(&earlier, &later, false), MS(20 + 30));
        later.throttled = MS(45);
        assert_eq!(
            upper_bound(&earlier, &later, true),
            MS(15),
            "its own quota does not count"
        );
        assert_eq!(upper_bound(&earlier, &earlier, true), MS(0));
    }

    #[test]
    fn throttling_by_the_own_quota_is_subtracted() {
        let start = Instant::now();
        let earlier = reading(start, 0, 0, &[cpu(0, 0, 0)]);
        let mut later = reading(start + MS(100), 10, 90, &[cpu(0, 0, 0)]);
        later.throttled = MS(50);
        assert_eq!(estimator(true).others_time(&earlier, &later), MS(30));
    }

    #[test]
    fn tick_rounding_never_favours_the_agent() {
        let start = Instant::now();
        let others_time = |agent, ticks| {
            let earlier = reading(start, 0, 0, &[cpu(0, 0, 0)]);
            let later = reading(start + MS(200), agent, 0, &[ticks]);
            estimator(false).others_time(&earlier, &later)
        };
        assert_eq!(others_time(0, cpu(20, 0, 0)), MS(180));
        assert_eq!(others_time(50, cpu(20, 0, 0)), MS(130));
        assert_eq!(
            others_time(0, cpu(1, 18, 0)),
            MS(0),
            "a tick proves nothing"
        );
        assert_eq!(others_time(0, cpu(10, 0, 10)), MS(180), "steal time counts");
        // The agent runs at each tick and sleeps in between, which counts as idle.
        assert_eq!(others_time(20, cpu(20, 17, 0)), MS(0));
        // The interrupts of the agent's timers came while the CPU was idle: no tick shows run time of a process.
        assert_eq!(others_time(1, cpu(1, 2, 0)), MS(0));
    }
}
