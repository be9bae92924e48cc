//! What ran on an agent's CPUs beside the agent, by the kernel's own counters: evidence that lies outside
//! of an agent's reach. Its timers' interrupts, its threads and its page faults are never among it, for
//! they count as the agent's own time, or as nobody's.
//!
//! Version 1 of the cgroup interface counts per CPU and in nanoseconds, for all and for the agent alike.
//! Version 2 tells only the agent's own time; what all did is then taken from `/proc/stat`, in ticks
//! of 10 ms. What such a tick leaves open is always read in the host's disfavour.

use crate::{
    OwnWait, cpu_clock,
    cpu_counters::{Ticks, of_cpus, text, throttled, ticks, ticks_of, usage},
    cpu_waits::{KnownThreads, Ledger, Outcome, Waits},
};
use std::{
    fs::{self, File},
    time::{Duration, Instant},
};

/// How far counters may lag behind: who runs is charged at the kernel's next tick, of which there are 100 in
/// a second at least.
const LAG: Duration = Duration::from_millis(10);

/// What is read right before a question, in some microseconds.
#[derive(Debug, Clone, Default)]
pub struct Glance {
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

/// Who ran.
#[derive(Debug)]
pub(crate) enum RunTime {
    /// `cpuacct.usage_percpu` of everything and of the agent.
    PerCpu { all: File, agent: File },
    /// The agent's `cpu.stat`.
    Whole { agent: File },
}

/// The counters at one time. Only the difference of two says something.
#[derive(Debug, Clone)]
pub struct CpuReading {
    at: Instant,
    agent: Duration,
    /// The same by the clocks of its processes, which do not lag behind but miss those that ended; zero at a
    /// glance.
    clocks: Duration,
    /// Run time of everything on the agent's CPUs; zero where only ticks tell.
    all: Duration,
    throttled: Duration,
    ticks: Vec<Ticks>,
    /// Of the agent's threads, where the kernel tells.
    waits: Option<Waits>,
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

impl CpuReading {
    /// When they were read.
    pub const fn at(&self) -> Instant {
        self.at
    }

    /// For how long since `before` the agent could have run and did not: none of its threads ran, and its own quota did
    /// not hold it up.
    fn idle_since(&self, before: &Self) -> Duration {
        self.at
            .saturating_duration_since(before.at)
            .saturating_sub(self.ran_since(before))
            .saturating_sub(self.throttled.saturating_sub(before.throttled))
    }

    /// What the agent ran, the most that either count tells.
    fn ran_since(&self, before: &Self) -> Duration {
        let by_clocks = self.clocks.saturating_sub(before.clocks);
        by_clocks.max(self.agent.saturating_sub(before.agent))
    }
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
        outcome: Outcome,
    ) -> Option<Taken> {
        let now = self.read(First::Others, agent)?;
        let none = Ledger::default();
        let judge = Judge {
            precise: matches!(self.run_time, RunTime::PerCpu { .. }),
            ledger: looks.map_or(&none, |looks| &looks.ledger),
            outcome,
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
            Some(now) => judge.ledger.longest_unlet(now, outcome).min(most),
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

/// How counters are read.
struct Judge<'a> {
    /// Do they tell of everything that ran, in nanoseconds?
    precise: bool,
    ledger: &'a Ledger,
    outcome: Outcome,
}

impl Judge<'_> {
    /// The longest wait of one of the agent's threads, as far as it counts; `None` where the kernel does not tell.
    fn waited(&self, from: &CpuReading, to: &CpuReading, wall: Duration) -> Option<Duration> {
        let (from, to) = (from.waits.as_ref()?, to.waits.as_ref()?);
        Some(to.longest_since(from, wall, self.ledger, self.outcome))
    }

    /// What others provably took of all CPUs at once.
    fn taken(&self, from: &CpuReading, to: &CpuReading) -> Duration {
        let wall = to.at.saturating_duration_since(from.at);
        let agent = to.agent.saturating_sub(from.agent);
        let (mut busy, mut idle, mut stolen) = (0, 0, 0);
        for (from, to) in from.ticks.iter().zip(&to.ticks) {
            // A counter that moved by n ticks has counted more than n - 1 and less than n + 1.
            let at_least = |from: u64, to: u64| to.saturating_sub(from).saturating_sub(1);
            busy += std::iter::zip(from.busy, to.busy)
                .map(|(from, to)| at_least(from, to))
                .sum::<u64>();
            idle += std::iter::zip(from.idle, to.idle)
                .map(|(from, to)| to.saturating_sub(from) + 1)
                .sum::<u64>();
            stolen += at_least(from.stolen, to.stolen);
        }
        // Who sleeps is kept from nothing, also while time is stolen: it ran, or seemed to, or waited to.
        let waited = self.waited(from, to, wall).unwrap_or(wall);
        let cpus = u32::try_from(to.ticks.len()).unwrap_or(u32::MAX);
        let (busy, idle, stolen) = (ticks(busy), ticks(idle), ticks(stolen));
        let others = if self.precise {
            // Kernels differ in whether stolen time is also somebody's run time: it must not count twice.
            to.all
                .saturating_sub(from.all)
                .saturating_sub(agent)
                .max(stolen)
        } else {
            // Ticks are sampled: an agent that runs whenever one is due would seem to be others. Then most of
            // the time is idle.
            (busy + stolen)
                .min((wall * cpus).saturating_sub(idle))
                .saturating_sub(agent)
        };
        // Whoever asks why an answer was late finds it in the log.
        tracing::debug!(
            ?wall,
            ?others,
            ?agent,
            ?stolen,
            ?waited,
            from = ?from.ticks,
            to = ?to.ticks,
            "evidence of what the host took"
        );
        others
            .saturating_sub(wall * cpus.saturating_sub(1))
            .saturating_sub(to.throttled.saturating_sub(from.throttled))
            .min(stolen.min(waited + agent).saturating_add(waited))
            .min(wall)
    }

    /// For how long the agent was kept from running by what does not lag behind: of an only CPU what one of its
    /// threads waited for, less what all of them ran; or what was stolen while one ran, seemed to, or waited to. An
    /// agent can bring about neither, and by sleeping it is kept from nothing.
    fn kept_waiting(&self, from: &CpuReading, to: &CpuReading) -> Duration {
        if !self.precise {
            return Duration::ZERO;
        }
        let wall = to.at.saturating_duration_since(from.at);
        let waited = match &to.ticks[..] {
            [_] => self.waited(from, to, wall).unwrap_or_default(),
            _ => Duration::ZERO,
        };
        let ran = to.agent.saturating_sub(from.agent);
        let stolen = stolen(from, to).min(waited + ran);
        waited
            .saturating_sub(ran)
            .saturating_sub(to.throttled.saturating_sub(from.throttled))
            .max(stolen)
            .min(wall)
    }
}

/// What others ran and what was stolen, on all CPUs together, less what the agent's own quota held it up.
fn most(from: &CpuReading, to: &CpuReading, precise: bool) -> Duration {
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

/// What the machine below a virtual one took, in the middle of what its ticks leave open. Of several CPUs one
/// was there at least for the rest.
fn stolen(from: &CpuReading, to: &CpuReading) -> Duration {
    let each = std::iter::zip(&from.ticks, &to.ticks);
    let stolen = each.map(|(from, to)| to.stolen.saturating_sub(from.stolen));
    ticks(stolen.min().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// Who was not let run while an answer may still come.
    const fn judge(precise: bool) -> Judge<'static> {
        static NONE: Ledger = Ledger::NONE;
        Judge {
            precise,
            ledger: &NONE,
            outcome: Outcome::Pending,
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
    fn only_what_ran_beside_the_agent_counts_and_never_more_than_the_time() {
        let begun = Instant::now();
        let taken = |agent: u64, all: u64, ticks: &[Ticks], wall: u64| {
            let still = vec![Ticks::default(); ticks.len()];
            let from = reading(begun, 500, 700, &still);
            let to = reading(begun + MS(wall), 500 + agent, 700 + all, ticks);
            judge(true).taken(&from, &to)
        };
        let one = [cpu(0, 0, 0)];
        assert_eq!(taken(0, 60, &one, 100), MS(60));
        assert_eq!(taken(40, 100, &one, 100), MS(60), "less what it ran itself");
        assert_eq!(
            taken(90, 90, &one, 100),
            MS(0),
            "its own threads are its own"
        );
        assert_eq!(
            taken(0, 0, &one, 100),
            MS(0),
            "it slept, or its timers fired"
        );
        assert_eq!(
            taken(0, 250, &one, 100),
            MS(100),
            "what ran before is not in the wait"
        );
        assert_eq!(
            taken(0, 0, &[cpu(0, 0, 8)], 100),
            MS(70),
            "the machine below took it"
        );
        assert_eq!(
            taken(0, 60, &[cpu(0, 0, 5)], 100),
            MS(60),
            "and is not counted twice"
        );
        // Of two CPUs one was free at least for the rest.
        let two = [cpu(0, 0, 0); 2];
        assert_eq!(taken(0, 100, &two, 100), MS(0));
        assert_eq!(taken(0, 170, &two, 100), MS(70));
    }

    #[test]
    fn what_a_thread_waited_for_on_its_only_cpu_was_taken_but_for_what_its_own_kin_ran() {
        let begun = Instant::now();
        let kept = |agent: u64, waited: u64, ticks: &[Ticks]| {
            let still = vec![Ticks::default(); ticks.len()];
            let mut from = reading(begun, 500, 700, &still);
            let mut to = reading(begun + MS(30), 500 + agent, 700, ticks);
            from.waits = Some(Waits::of_one_thread(MS(400), MS(10)));
            to.waits = Some(Waits::of_one_thread(MS(401), MS(10 + waited)));
            judge(true).kept_waiting(&from, &to)
        };
        let one = [cpu(0, 0, 0)];
        assert_eq!(kept(1, 26, &one), MS(25));
        assert_eq!(kept(30, 29, &one), MS(0), "its other threads ran");
        assert_eq!(kept(1, 0, &one), MS(0), "it slept");
        assert_eq!(kept(1, 26, &[cpu(0, 0, 0); 2]), MS(0), "another was free");
        assert_eq!(
            kept(25, 0, &[cpu(0, 0, 2)]),
            MS(20),
            "stolen while it seemed to run"
        );
        assert_eq!(kept(1, 0, &[cpu(0, 0, 2)]), MS(1), "it slept meanwhile");
        assert_eq!(kept(20, 25, &[cpu(0, 0, 9)]), MS(30), "never more than all");
        assert_eq!(kept(1, 0, &[cpu(0, 0, 2), cpu(0, 0, 0)]), MS(0));
        let mut from = reading(begun, 500, 700, &one);
        let mut to = reading(begun + MS(250), 501, 700, &[cpu(0, 0, 15)]);
        from.waits = Some(Waits::of_one_thread(MS(400), MS(10)));
        to.waits = from.waits.clone();
        assert_eq!(
            judge(true).taken(&from, &to),
            MS(1),
            "a sleeper's time is its own"
        );
        let still = reading(begun, 0, 0, &one);
        assert_eq!(
            judge(false).kept_waiting(&still, &still),
            MS(0),
            "ticks alone"
        );
    }

    #[test]
    fn a_thread_that_two_looks_find_waiting_was_kept_from_running_but_for_what_ran() {
        let begun = Instant::now();
        let at = |ms, agent, slices, stolen, wants_to_run| {
            let mut reading = reading(begun + MS(ms), agent, 0, &[cpu(0, 0, stolen)]);
            reading.waits = Some(Waits::of_one_thread_let(slices, wants_to_run));
            reading
        };
        let first = at(10, 3, 7, 5, true);
        let pending = |looks: &Looks, now: &CpuReading| {
            let waits = now.waits.as_ref().unwrap();
            looks.ledger.longest_unlet(waits, Outcome::Pending)
        };
        let unlet = |later: &CpuReading| {
            let mut looks = Looks::begin(first.clone(), None, begun);
            looks.add(later.clone());
            pending(&looks, later)
        };
        assert_eq!(unlet(&at(15, 3, 7, 5, true)), MS(5));
        assert_eq!(unlet(&at(15, 5, 7, 5, true)), MS(3), "less what it ran");
        assert_eq!(
            unlet(&at(15, 9, 7, 5, true)),
            MS(0),
            "with its other threads"
        );
        assert_eq!(unlet(&at(15, 3, 8, 5, true)), MS(0), "it may have slept");
        assert_eq!(unlet(&at(15, 3, 7, 5, false)), MS(0), "it sleeps");
        let mut throttled = at(15, 3, 7, 5, true);
        throttled.throttled = MS(4);
        assert_eq!(unlet(&throttled), MS(1), "its own quota");
        let mut ended = at(15, 3, 7, 5, true);
        (ended.clocks, ended.agent) = (MS(0), MS(7));
        assert_eq!(unlet(&ended), MS(1), "a process that ended ran, too");

        // A glance does not tell who wants to run.
        let glance = at(0, 3, 7, 4, false);
        let stolen = |now: &CpuReading| {
            let looks = Looks::begin(now.clone(), Some(&glance), begun + MS(2));
            pending(&looks, now)
        };
        assert_eq!(stolen(&at(10, 3, 7, 4, true)), MS(0), "nothing was stolen");
        assert_eq!(stolen(&at(20, 3, 7, 5, true)), MS(10));
        assert_eq!(stolen(&at(10, 3, 7, 6, true)), MS(8), "never more than all");
        assert_eq!(stolen(&at(10, 3, 7, 6, false)), MS(0), "it sleeps");
        assert_eq!(stolen(&at(10, 3, 8, 6, true)), MS(0), "it was let run");
    }

    #[test]
    fn no_more_can_have_been_taken_than_others_ran_and_was_stolen() {
        let begun = Instant::now();
        let still = [Ticks::default(); 2];
        let from = reading(begun, 500, 700, &still);
        let mut to = reading(begun + MS(100), 520, 750, &[cpu(4, 0, 1), cpu(0, 0, 2)]);
        assert_eq!(most(&from, &to, true), MS(30 + 30));
        assert_eq!(most(&from, &to, false), MS(20 + 30));
        to.throttled = MS(45);
        assert_eq!(most(&from, &to, true), MS(15), "its own quota is its own");
        assert_eq!(most(&from, &from, true), MS(0));
    }

    #[test]
    fn its_own_quota_is_no_excuse() {
        let begun = Instant::now();
        let from = reading(begun, 0, 0, &[cpu(0, 0, 0)]);
        let mut to = reading(begun + MS(100), 10, 90, &[cpu(0, 0, 0)]);
        to.throttled = MS(50);
        assert_eq!(judge(true).taken(&from, &to), MS(30));
    }

    #[test]
    fn ticks_are_read_in_the_hosts_disfavour() {
        let begun = Instant::now();
        let taken = |agent, ticks| {
            let from = reading(begun, 0, 0, &[cpu(0, 0, 0)]);
            let to = reading(begun + MS(200), agent, 0, &[ticks]);
            judge(false).taken(&from, &to)
        };
        assert_eq!(taken(0, cpu(20, 0, 0)), MS(180));
        assert_eq!(taken(50, cpu(20, 0, 0)), MS(130));
        assert_eq!(taken(0, cpu(1, 18, 0)), MS(0), "a tick proves nothing");
        assert_eq!(taken(0, cpu(10, 0, 10)), MS(180), "steal counts");
        // It runs whenever a tick is due and sleeps in between, which is idle.
        assert_eq!(taken(20, cpu(20, 17, 0)), MS(0));
        // Its timers' interrupts came out of idleness: no tick says that somebody ran.
        assert_eq!(taken(1, cpu(1, 2, 0)), MS(0));
    }
}
