//! What ran on an agent's CPUs beside the agent, by the kernel's own counters: evidence that lies outside
//! of an agent's reach. Its timers' interrupts, its threads and its page faults are never among it, for
//! they count as the agent's own time, or as nobody's.
//!
//! Version 1 of the cgroup interface counts per CPU and in nanoseconds, for all and for the agent alike.
//! Version 2 tells only the agent's own time; what all did is then taken from `/proc/stat`, in ticks
//! of 10 ms. What such a tick leaves open is always read in the host's disfavour.

mod judge;
mod reading;

use crate::{
    OwnWait, cpu_clock,
    cpu_counters::{of_cpus, text, throttled, ticks_of, usage},
    cpu_waits::{AnswerState, KnownThreads, Ledger},
};
use judge::{Judge, most, stolen};
pub use reading::CpuReading;
use std::{
    fs::{self, File},
    time::{Duration, Instant},
};

/// How far counters may lag behind: who runs is charged at the kernel's next tick, of which there are 100 in
/// a second at least.
const LAG: Duration = Duration::from_millis(10);

/// What is read right before a question, in some microseconds.
#[derive(Debug, Clone)]
pub struct Glance {
    pub at: Instant,
    /// The counters of the agent's CPUs, without what its threads want; `None` without a cgroup, and where the kernel
    /// counts in ticks alone.
    pub cpus: Option<CpuReading>,
    /// Those of the calling thread, if they were asked for.
    pub own: Option<OwnWait>,
}

/// Where the counters of one agent are.
#[derive(Debug)]
pub(crate) struct CpuEvidence {
    /// The CPUs that the agent may use.
    pub cpus: Vec<usize>,
    pub run_time: RunTime,
    /// The agent's `cpu.stat`, for what its own quota held it up.
    pub throttled: Option<File>,
}

#[derive(Debug)]
pub(crate) enum RunTime {
    /// `cpuacct.usage_percpu` of everything and of the agent.
    PerCpu { all: File, agent: File },
    /// The agent's `cpu.stat`.
    Whole { agent: File },
}

/// What was taken of a span of an agent's time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Taken {
    /// For how long it was kept from running.
    pub kept: Duration,
    /// How much of the span there was no CPU at all, for a machine below a virtual one held it up. Kernels
    /// differ in whether that is also the run time of whoever was on it.
    pub stolen: Duration,
}

/// Which counters are read first: between two readings others must seem to have run for less.
#[derive(Clone, Copy, PartialEq, Eq)]
enum First {
    Agent,
    Others,
}

/// What looks at the CPUs of an agent whose answer is late have found. A thread that was woken on a CPU which the
/// machine below holds up is seen by nothing else: its wait is counted from when that CPU has heard of it.
#[derive(Debug, Clone)]
pub struct Looks {
    first: CpuReading,
    /// If there were more than one.
    last: Option<CpuReading>,
    ledger: Ledger,
}

impl Looks {
    /// The first look, at an agent that was `asked` after a `glance`.
    #[must_use]
    pub fn begin(first: CpuReading, glance: Option<&CpuReading>, asked: Instant) -> Self {
        let mut ledger = Ledger::default();
        if let (Some(now), Some(glance)) = (&first.waits, glance)
            && let Some(then) = &glance.waits
        {
            let stolen = stolen(glance, &first).min(first.at.saturating_duration_since(asked));
            ledger.begin(then, now, stolen);
        }
        Self {
            first,
            last: None,
            ledger,
        }
    }

    /// A look more, which finds no answer either.
    pub fn add(&mut self, now: CpuReading) {
        let before = self.last.as_ref().unwrap_or(&self.first);
        if let (Some(then), Some(waits)) = (&before.waits, &now.waits) {
            self.ledger.add(then, waits, now.idle_since(before));
        }
        self.last = Some(now);
    }
}

impl CpuEvidence {
    /// The counters now, as the beginning of a span; `None` if the host does not tell.
    pub(crate) fn begin(&self, agent: &KnownThreads) -> Option<CpuReading> {
        self.read(First::Agent, agent)
    }

    /// The counters now as far as they are read in some microseconds, as the beginning of a span: of known
    /// threads only. `None` if the host does not tell, or in ticks alone.
    pub(crate) fn glance(&self, agent: &KnownThreads, stat: &str) -> Option<CpuReading> {
        let RunTime::PerCpu { all, .. } = &self.run_time else {
            return None;
        };
        Some(CpuReading {
            agent: self.agent()?,
            clocks: Duration::ZERO,
            all: of_cpus(&text(all)?, &self.cpus)?,
            throttled: self.throttled(),
            ticks: ticks_of(stat, &self.cpus)?,
            waits: Some(agent.glance()?),
            at: Instant::now(),
        })
    }

    /// What was taken of the time since the looks began, or by the glance before the agent was `asked`: for how long it
    /// was kept from running, the most that any of them proves, and how much was stolen since the earlier of them.
    pub(crate) fn taken_since(
        &self,
        asked: Instant,
        looks: Option<&Looks>,
        glance: Option<&CpuReading>,
        agent: &KnownThreads,
        answer: AnswerState,
    ) -> Option<Taken> {
        let now = self.read(First::Others, agent)?;
        let none = Ledger::default();
        let judge = Judge {
            precise: matches!(self.run_time, RunTime::PerCpu { .. }),
            ledger: looks.map_or(&none, |looks| &looks.ledger),
            answer,
        };
        let begun = looks.map(|looks| &looks.first);
        let since_begun = begun.map(|begun| {
            judge
                .taken(begun, &now)
                .max(judge.kept_waiting(begun, &now))
        });
        // What others ran right before a glance may be charged to them after it, and what they ran between it
        // and the question was not taken from the answer.
        let since_glance = glance.map(|glance| {
            let age = asked.saturating_duration_since(glance.at);
            let ran = judge.taken(glance, &now).saturating_sub(LAG + age);
            ran.max(judge.kept_waiting(glance, &now).saturating_sub(age))
        });
        // The earlier reading is the one of the longer span.
        let from = glance.or(begun);
        let most = from
            .map(|from| most(from, &now, judge.precise))
            .unwrap_or_default();
        let unlet = match &now.waits {
            Some(now) => judge.ledger.longest_unlet(now, answer).min(most),
            None => Duration::ZERO,
        };
        Some(Taken {
            kept: since_begun.max(since_glance).unwrap_or_default().max(unlet),
            stolen: from.map(|from| stolen(from, &now)).unwrap_or_default(),
        })
    }

    fn read(&self, first: First, threads: &KnownThreads) -> Option<CpuReading> {
        let mut at = Instant::now();
        let mut agent = Duration::ZERO;
        if first == First::Agent {
            agent = self.agent()?;
        }
        let all = match &self.run_time {
            RunTime::PerCpu { all, .. } => of_cpus(&text(all)?, &self.cpus)?,
            RunTime::Whole { .. } => Duration::ZERO,
        };
        let ticks = ticks_of(&fs::read_to_string("/proc/stat").ok()?, &self.cpus)?;
        if first == First::Others {
            agent = self.agent()?;
        } else {
            at = Instant::now();
        }
        Some(CpuReading {
            at,
            agent,
            clocks: cpu_clock::run_time_of(threads.processes()),
            all,
            throttled: self.throttled(),
            ticks,
            waits: threads.look(),
        })
    }

    fn throttled(&self) -> Duration {
        let file = self.throttled.as_ref();
        let told = file.and_then(|file| throttled(&text(file)?));
        told.unwrap_or_default()
    }

    fn agent(&self) -> Option<Duration> {
        match &self.run_time {
            RunTime::PerCpu { agent, .. } => of_cpus(&text(agent)?, &self.cpus),
            RunTime::Whole { agent } => usage(&text(agent)?),
        }
    }
}
