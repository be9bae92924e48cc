//! Measures *host interference*: the time in which an agent was ready to run, but other processes ran on its CPUs. It uses the
//! kernel's own counters, which no agent can manipulate. The interrupts of an agent's timers, its threads and its page faults are never
//! included: the kernel counts them as the agent's own time, or not at all.
//!
//! Cgroup version 1 counts per CPU and in nanoseconds, both for all processes and for the agent. Version 2 counts
//! only the agent's own time. The total then comes from `/proc/stat`, in ticks of 10 ms. Rounding of ticks is always
//! resolved to the smallest possible interference.

mod estimator;
mod reading;

use crate::{
    EvaluatorCounters, cpu_clock,
    cpu_counters::{parse_throttled, parse_ticks, parse_usage, read_text, sum_of_cpus},
    thread_waits::{AnswerState, TrackedThreads, WaitLedger},
};
use estimator::{InterferenceEstimator, stolen_time, upper_bound};
pub use reading::CpuReading;
use std::{
    fs::{self, File},
    time::{Duration, Instant},
};

/// Maximum lag of the counters behind the true run time: the kernel charges a running thread at its next tick, at least 100 times a second.
const MAX_COUNTER_LAG: Duration = Duration::from_millis(10);

/// Counters read right before a question (a message to the agent that expects an answer). Later readings are compared with them.
/// Reading them takes a few microseconds.
#[derive(Debug, Clone)]
pub struct CounterBaseline {
    /// When the counters were read.
    pub read_at: Instant,
    /// Counters of the agent's CPUs, without the states of its threads. `None` without a cgroup, or if the kernel
    /// counts in ticks only.
    pub cpus: Option<CpuReading>,
    /// Counters of the calling thread (the evaluator's), if requested.
    pub evaluator: Option<EvaluatorCounters>,
}

/// The open counter files of one agent.
#[derive(Debug)]
pub(crate) struct CpuAccounting {
    /// The CPUs that the agent may use.
    pub cpus: Vec<usize>,
    /// The counters of run time.
    pub run_time: RunTimeFiles,
    /// The agent's `cpu.stat`, for the time in which its own quota throttled it.
    pub throttled: Option<File>,
}

/// The open files with the counters of run time.
#[derive(Debug)]
pub(crate) enum RunTimeFiles {
    /// `cpuacct.usage_percpu` of all processes and of the agent.
    PerCpu { all: File, agent: File },
    /// The agent's `cpu.stat`.
    Whole { agent: File },
}

/// Host interference during a span of time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HostInterference {
    /// Time in which the agent was runnable and could not run.
    pub run_delay: Duration,
    /// Steal time: the hypervisor had stopped the CPUs. Kernels differ in whether they also count it as run time of
    /// the current thread.
    pub stolen: Duration,
}

/// Order in which the counters are read. It must make the run time of other processes seem shorter, never longer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ReadOrder {
    AgentFirst,
    OthersFirst,
}

/// Samples of the counters while an answer is late. Only samples show the wait of a thread that was woken on a CPU
/// stopped by the hypervisor: the kernel's own counter starts when that CPU runs again.
#[derive(Debug, Clone)]
pub struct CpuSamples {
    first: CpuReading,
    /// `None` if there is only one sample.
    last: Option<CpuReading>,
    /// Waits of the agent's threads, as the samples show them.
    ledger: WaitLedger,
}

impl CpuSamples {
    /// Starts with the first sample. `asked_at` is the time of the question, shortly after the `baseline` was read.
    #[must_use]
    pub fn begin(first: CpuReading, baseline: Option<&CpuReading>, asked_at: Instant) -> Self {
        let mut ledger = WaitLedger::default();
        if let (Some(now), Some(baseline)) = (&first.waits, baseline)
            && let Some(earlier) = &baseline.waits
        {
            let stolen = stolen_time(baseline, &first)
                .min(first.read_at.saturating_duration_since(asked_at));
            ledger.begin(earlier, now, stolen);
        }
        Self {
            first,
            last: None,
            ledger,
        }
    }

    /// Adds another sample, taken while the answer is still pending.
    pub fn add(&mut self, now: CpuReading) {
        let earlier_reading = self.last.as_ref().unwrap_or(&self.first);
        if let (Some(earlier), Some(waits)) = (&earlier_reading.waits, &now.waits) {
            self.ledger
                .add(earlier, waits, now.idle_since(earlier_reading));
        }
        self.last = Some(now);
    }
}

impl CpuAccounting {
    /// Reads all counters as the start of a span; `None` if the host has none.
    pub(crate) fn read_cpus(&self, threads: &TrackedThreads) -> Option<CpuReading> {
        self.read(ReadOrder::AgentFirst, threads)
    }

    /// Reads those counters that take only a few microseconds, as the start of a span; of threads, only the tracked ones. `None` if
    /// the host has no such counters, or counts in ticks only.
    pub(crate) fn read_cpu_baseline(
        &self,
        threads: &TrackedThreads,
        stat: &str,
    ) -> Option<CpuReading> {
        let RunTimeFiles::PerCpu { all, .. } = &self.run_time else {
            return None;
        };
        Some(CpuReading {
            agent_run_time: self.agent_run_time()?,
            agent_clock_time: Duration::ZERO,
            total_run_time: sum_of_cpus(&read_text(all)?, &self.cpus)?,
            throttled: self.throttled(),
            ticks: parse_ticks(stat, &self.cpus)?,
            waits: Some(threads.read_counters()?),
            read_at: Instant::now(),
        })
    }

    /// Host interference since the question (`asked_at`): the longest run delay that the samples or the baseline prove,
    /// and the steal time since the earlier of them.
    pub(crate) fn interference_since(
        &self,
        asked_at: Instant,
        samples: Option<&CpuSamples>,
        baseline: Option<&CpuReading>,
        threads: &TrackedThreads,
        answer: AnswerState,
    ) -> Option<HostInterference> {
        let now = self.read(ReadOrder::OthersFirst, threads)?;
        let empty_ledger = WaitLedger::default();
        let estimator = InterferenceEstimator {
            is_precise: matches!(self.run_time, RunTimeFiles::PerCpu { .. }),
            ledger: samples.map_or(&empty_ledger, |samples| &samples.ledger),
            answer,
        };
        let first = samples.map(|samples| &samples.first);
        let since_samples = first.map(|first| {
            estimator
                .others_time(first, &now)
                .max(estimator.run_delay(first, &now))
        });
        // The kernel may charge other processes after the baseline for time that they ran before it, and their time
        // between the baseline and the question did not delay the answer. Both are subtracted.
        let since_baseline = baseline.map(|baseline| {
            let baseline_age = asked_at.saturating_duration_since(baseline.read_at);
            let others_time = estimator
                .others_time(baseline, &now)
                .saturating_sub(MAX_COUNTER_LAG + baseline_age);
            others_time.max(
                estimator
                    .run_delay(baseline, &now)
                    .saturating_sub(baseline_age),
            )
        });
        // The baseline is the earlier reading, so it covers the longer span.
        let earliest = baseline.or(first);
        let max_interference = earliest
            .map(|earliest| upper_bound(earliest, &now, estimator.is_precise))
            .unwrap_or_default();
        let observed_wait = match &now.waits {
            Some(now) => estimator
                .ledger
                .longest_observed_wait(now, answer)
                .min(max_interference),
            None => Duration::ZERO,
        };
        Some(HostInterference {
            run_delay: since_samples
                .max(since_baseline)
                .unwrap_or_default()
                .max(observed_wait),
            stolen: earliest
                .map(|earliest| stolen_time(earliest, &now))
                .unwrap_or_default(),
        })
    }

    fn read(&self, order: ReadOrder, threads: &TrackedThreads) -> Option<CpuReading> {
        let mut read_at = Instant::now();
        let mut agent_run_time = Duration::ZERO;
        if order == ReadOrder::AgentFirst {
            agent_run_time = self.agent_run_time()?;
        }
        let total_run_time = match &self.run_time {
            RunTimeFiles::PerCpu { all, .. } => sum_of_cpus(&read_text(all)?, &self.cpus)?,
            RunTimeFiles::Whole { .. } => Duration::ZERO,
        };
        let ticks = parse_ticks(&fs::read_to_string("/proc/stat").ok()?, &self.cpus)?;
        if order == ReadOrder::OthersFirst {
            agent_run_time = self.agent_run_time()?;
        } else {
            read_at = Instant::now();
        }
        Some(CpuReading {
            read_at,
            agent_run_time,
            agent_clock_time: cpu_clock::total_run_time(threads.processes()),
            total_run_time,
            throttled: self.throttled(),
            ticks,
            waits: threads.sample(),
        })
    }

    fn throttled(&self) -> Duration {
        let file = self.throttled.as_ref();
        let throttled = file.and_then(|file| parse_throttled(&read_text(file)?));
        throttled.unwrap_or_default()
    }

    /// Run time of the agent on its CPUs.
    fn agent_run_time(&self) -> Option<Duration> {
        match &self.run_time {
            RunTimeFiles::PerCpu { agent, .. } => sum_of_cpus(&read_text(agent)?, &self.cpus),
            RunTimeFiles::Whole { agent } => parse_usage(&read_text(agent)?),
        }
    }
}
