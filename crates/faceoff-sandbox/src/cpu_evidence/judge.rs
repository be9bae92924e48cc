//! What two readings of the counters prove.

use super::reading::CpuReading;
use crate::{
    cpu_counters::ticks,
    cpu_waits::{AnswerState, Ledger},
};
use std::time::Duration;

/// How counters are read.
pub(super) struct Judge<'a> {
    /// Do they tell of everything that ran, in nanoseconds?
    pub precise: bool,
    pub ledger: &'a Ledger,
    pub answer: AnswerState,
}

impl Judge<'_> {
    /// The longest wait of one of the agent's threads, as far as it counts; `None` where the kernel does not tell.
    fn waited(&self, from: &CpuReading, to: &CpuReading, wall: Duration) -> Option<Duration> {
        let (from, to) = (from.waits.as_ref()?, to.waits.as_ref()?);
        Some(to.longest_since(from, wall, self.ledger, self.answer))
    }

    /// What others provably took of all CPUs at once.
    pub fn taken(&self, from: &CpuReading, to: &CpuReading) -> Duration {
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
    pub fn kept_waiting(&self, from: &CpuReading, to: &CpuReading) -> Duration {
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
pub(super) fn most(from: &CpuReading, to: &CpuReading, precise: bool) -> Duration {
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
pub(super) fn stolen(from: &CpuReading, to: &CpuReading) -> Duration {
    let each = std::iter::zip(&from.ticks, &to.ticks);
    let stolen = each.map(|(from, to)| to.stolen.saturating_sub(from.stolen));
    ticks(stolen.min().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Looks, cpu_counters::Ticks, cpu_waits::Waits};
    use std::time::Instant;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// Who was not let run while an answer may still come.
    const fn judge(precise: bool) -> Judge<'static> {
        static NONE: Ledger = Ledger::NONE;
        Judge {
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
            looks.ledger.longest_unlet(waits, AnswerState::Pending)
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
