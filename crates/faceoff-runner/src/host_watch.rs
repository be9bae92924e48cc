//! What did the host take of the time of an answer? Only what the kernel's counters prove, and only of
//! answers that are late: before that there is no more than a glance at them, which costs some
//! microseconds.

use faceoff_sandbox::{CpuReading, Glance, Looks, OwnWait};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// An answer that takes longer is looked after. Half of the lowest limit that costs points, and as long as
/// the kernel's counters may lag behind: what they tell later was then within the wait.
pub(crate) const FIRST_LOOK: Duration = Duration::from_millis(10);
/// How often the evaluator wakes while an answer is late, so that its own lateness can be told.
pub(crate) const NEXT_LOOK: Duration = Duration::from_millis(5);
/// How old what the counters said before a question may be. That much less is proven by it, which with the
/// counters' own lag leaves less than costs points.
pub(crate) const GLANCE_LASTS: Duration = Duration::from_millis(5);
/// An evaluator that wakes late by no more than this was not held up.
const ORDINARY_LATENESS: Duration = Duration::from_millis(1);
/// A hard limit is extended by the host's share up to this many times itself; then the host explains
/// the missing answer.
pub(crate) const LONGEST_EXTENSION: u32 = 4;

/// Judges the evidence of what the host took; tests put others in its place.
pub trait HostWatch: std::fmt::Debug + Sync {
    /// How much of the wait from `asked` to `now` the host took, given what the kernel's counters prove;
    /// `None` where there are none.
    fn taken(&self, asked: Instant, now: Instant, proven: Option<Duration>) -> Duration;
}

/// Nothing but what is proven.
#[derive(Debug, Clone, Copy)]
pub struct Counters;

impl HostWatch for Counters {
    fn taken(&self, _: Instant, _: Instant, proven: Option<Duration>) -> Duration {
        proven.unwrap_or_default()
    }
}

/// One wait for an answer, as far as the host is concerned.
#[derive(Debug, Clone)]
pub(crate) struct Wait {
    /// From when on the time counts.
    pub asked: Instant,
    limit: Duration,
    /// What the counters said before, at a glance, [`GLANCE_LASTS`] ago at most.
    before: Option<Arc<Glance>>,
    /// By how much too long it took the evaluator to write the question.
    held_up: Duration,
    /// The answer is late, and this is what the counters said since.
    late: Option<Option<Looks>>,
    /// For how long the evaluator was busy with another agent's end since nothing was there.
    away: Duration,
    /// When the evaluator wants to be woken.
    pub wake: Instant,
    /// When the limit is over, as extended so far.
    pub deadline: Instant,
}

/// What the counters say of a wait so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evidence {
    pub now: Instant,
    /// That the agent was kept from running; `None` where the host does not tell.
    pub kept: Option<Duration>,
    /// That there was no CPU at all: nobody ran, even if a kernel counts it as somebody's run time.
    pub stolen: Duration,
    /// That the agent itself ran, since it was asked.
    pub agent_ran: Option<Duration>,
    /// For how long the evaluator itself was kept from running, since shortly before it asked; `None` if its CPUs are
    /// the agent's, too.
    pub own_wait: Option<Duration>,
}

impl Wait {
    /// The wait for an answer to what was asked at `asked`, whose limit runs from then on; the attempt to
    /// write it, which waits for nothing, was over at `written`.
    pub fn begin(
        before: Option<Arc<Glance>>,
        asked: Instant,
        written: Instant,
        limit: Duration,
    ) -> Self {
        let deadline = asked + limit;
        Self {
            asked,
            limit,
            before,
            held_up: lateness(asked, written),
            late: None,
            away: Duration::ZERO,
            wake: (asked + FIRST_LOOK).min(deadline),
            deadline,
        }
    }

    /// Has the answer taken so long that the host is looked at, or did the evaluator wake late?
    pub fn is_late(&self, now: Instant) -> bool {
        self.late.is_some() || now > self.wake + ORDINARY_LATENESS
    }

    /// Has the agent not been looked at since it was asked?
    pub fn is_first_look(&self) -> bool {
        self.late.is_none()
    }

    /// What the counters say at a look, now that the answer is late.
    pub fn look(&mut self, reading: Option<CpuReading>) {
        match (&mut self.late, reading) {
            (None, reading) => {
                let begin = |now| Looks::begin(now, self.cpus_before(), self.asked);
                self.late = Some(reading.map(begin));
            }
            (Some(Some(looks)), Some(reading)) => looks.add(reading),
            (Some(_), _) => {}
        }
    }

    /// What the counters of the agent's CPUs said at a glance before the question.
    pub fn cpus_before(&self) -> Option<&CpuReading> {
        self.before.as_ref()?.cpus.as_ref()
    }

    /// … and those of the evaluator's own thread.
    pub fn own_before(&self) -> Option<&OwnWait> {
        self.before.as_ref()?.own.as_ref()
    }

    /// What the counters said since the answer was found to be late.
    pub fn looks(&self) -> Option<&Looks> {
        self.late.as_ref()?.as_ref()
    }

    /// The evaluator could not look for an answer for so long.
    pub fn was_away(&mut self, away: Duration) {
        self.away += away;
    }

    /// The evaluator looked, and there was nothing: whatever kept it from looking earlier made nothing later.
    pub fn nothing_is_there(&mut self) {
        self.away = Duration::ZERO;
    }

    /// The evaluator woke for nothing: when to wake next.
    pub fn sleep_on(&mut self, now: Instant) {
        self.wake = (now + NEXT_LOOK).min(self.deadline);
    }

    /// How much of the wait until now the host took.
    pub fn taken(&self, watch: &dyn HostWatch, evidence: Evidence) -> Duration {
        let Evidence {
            now,
            kept,
            stolen,
            agent_ran,
            own_wait,
        } = evidence;
        let wall = now.saturating_duration_since(self.asked);
        // An answer that lay there when the evaluator woke late may have come at any time since it wanted
        // to, and a question that it was held up with may not have been there to be answered. That is nobody's fault
        // here as far as it wanted to run and was not let, on CPUs out of the agent's reach. What else one of its calls
        // may have waited for the agent may have held.
        let overslept = match (kept, own_wait) {
            (Some(_), Some(own)) => own.min(self.held_up + lateness(self.wake, now)),
            _ => Duration::ZERO,
        };
        let ran = agent_ran.map_or(wall, |ran| ran.min(wall.saturating_sub(stolen)));
        let proven = kept
            .map(|kept| kept + overslept)
            // Whatever the rest says: while it ran, it was not kept from running.
            .map(|proven| proven.min(wall.saturating_sub(ran)));
        // What the evaluator did elsewhere is nobody's but ours, whoever shares whose CPUs; but an agent that ran
        // meanwhile had not answered yet.
        let away = wall.saturating_sub(agent_ran.unwrap_or_default());
        watch
            .taken(self.asked, now, proven)
            .max(self.away.min(away))
            .min(wall)
    }

    /// The limit is over: extends it by what the host took, unless it is over all the same.
    pub fn extend(&mut self, now: Instant, taken: Duration) -> Over {
        let own = now
            .saturating_duration_since(self.asked)
            .saturating_sub(taken);
        if own >= self.limit {
            return Over::ByTheAgent;
        }
        let last = self.asked + self.limit * (1 + LONGEST_EXTENSION);
        if now >= last {
            return Over::ByTheHost;
        }
        self.deadline = (now + (self.limit - own)).min(last);
        self.sleep_on(now);
        Over::No
    }
}

/// By how much an evaluator was late, if more than is ordinary.
fn lateness(due: Instant, now: Instant) -> Duration {
    let late = now.saturating_duration_since(due);
    if late > ORDINARY_LATENESS {
        late
    } else {
        Duration::ZERO
    }
}

/// Whose doing is it that a limit is over?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Over {
    No,
    ByTheAgent,
    ByTheHost,
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: fn(u64) -> Duration = Duration::from_millis;

    /// An evaluator that did nothing but wait to run, if its CPUs are its own.
    fn evidence(now: Instant, others_ms: u64, agent_ms: u64, apart: bool) -> Evidence {
        Evidence {
            now,
            kept: Some(MS(others_ms)),
            stolen: Duration::ZERO,
            agent_ran: Some(MS(agent_ms)),
            own_wait: apart.then_some(MS(1000)),
        }
    }

    #[test]
    fn what_the_agent_ran_itself_is_never_the_hosts() {
        let asked = Instant::now();
        let wait = Wait::begin(None, asked, asked, MS(1000));
        let taken =
            |others, agent| wait.taken(&Counters, evidence(asked + MS(10), others, agent, false));
        assert_eq!(taken(4, 1), MS(4));
        assert_eq!(taken(9, 8), MS(2));
        assert_eq!(taken(9, 30), MS(0), "several threads");
        let unknown = Evidence {
            agent_ran: None,
            ..evidence(asked + MS(10), 9, 0, true)
        };
        assert_eq!(wait.taken(&Counters, unknown), MS(0));
        let stolen = Evidence {
            stolen: MS(9),
            ..evidence(asked + MS(10), 9, 5, false)
        };
        assert_eq!(
            wait.taken(&Counters, stolen),
            MS(9),
            "what was stolen was not run, whoever it is counted for"
        );
        let nothing = Evidence {
            kept: None,
            ..evidence(asked + MS(80), 0, 0, true)
        };
        assert_eq!(
            wait.taken(&Counters, nothing),
            MS(0),
            "no cgroup, no excuse"
        );
    }

    #[test]
    fn an_evaluator_that_wakes_late_beyond_the_agents_reach_is_the_hosts_doing() {
        let asked = Instant::now();
        let mut wait = Wait::begin(None, asked, asked, MS(1000));
        let taken =
            |wait: &Wait, at, apart| wait.taken(&Counters, evidence(asked + MS(at), 0, 1, apart));
        assert_eq!(taken(&wait, 9, true), MS(0));
        assert_eq!(taken(&wait, 11, true), MS(0), "ordinary");
        assert_eq!(taken(&wait, 60, true), MS(50));
        assert_eq!(
            taken(&wait, 60, false),
            MS(0),
            "the agent may have starved it"
        );
        // It woke for nothing at 12 ms: only what comes after that made the answer later.
        wait.sleep_on(asked + MS(12));
        assert_eq!(taken(&wait, 60, true), MS(43));
    }

    #[test]
    fn an_evaluator_that_is_held_up_while_it_asks_is_the_hosts_doing_too() {
        let asked = Instant::now();
        let taken = |written, at, apart| {
            let mut wait = Wait::begin(None, asked, asked + MS(written), MS(1000));
            // Nothing was there when it came to look.
            wait.sleep_on(asked + MS(written));
            wait.taken(&Counters, evidence(asked + MS(at), 0, 1, apart))
        };
        assert_eq!(taken(40, 42, true), MS(40));
        assert_eq!(taken(40, 42, false), MS(0), "it may have run meanwhile");
        assert_eq!(taken(1, 12, true), MS(6), "that is ordinary");
        assert_eq!(taken(40, 41, true), MS(40), "but never what it ran");
    }

    #[test]
    fn only_its_own_wait_to_run_excuses_an_evaluator() {
        let asked = Instant::now();
        let wait = Wait::begin(None, asked, asked + MS(5000), MS(1000));
        let taken = |own| {
            let evidence = Evidence {
                own_wait: Some(MS(own)),
                ..evidence(asked + MS(5001), 0, 1, true)
            };
            wait.taken(&Counters, evidence)
        };
        assert_eq!(taken(0), MS(0), "something else held its call");
        assert_eq!(taken(30), MS(30));
    }

    #[test]
    fn an_evaluator_that_saw_to_another_agent_is_nobodys_delay() {
        let asked = Instant::now();
        let mut wait = Wait::begin(None, asked, asked, MS(1000));
        let taken =
            |wait: &Wait, at, ran| wait.taken(&Counters, evidence(asked + MS(at), 0, ran, false));
        wait.was_away(MS(500));
        assert_eq!(
            taken(&wait, 510, 1),
            MS(500),
            "its answer may lie there for as long"
        );
        assert_eq!(taken(&wait, 510, 300), MS(210), "but it ran");
        assert_eq!(
            taken(&wait, 400, 1),
            MS(399),
            "but never longer than the wait"
        );
        wait.nothing_is_there();
        assert_eq!(taken(&wait, 510, 1), MS(0), "it was still at work");
    }

    #[test]
    fn a_limit_goes_on_while_the_host_explains_it_and_not_for_ever() {
        let asked = Instant::now();
        let at = |ms| asked + MS(ms);
        let mut wait = Wait::begin(None, asked, asked, MS(1000));
        assert_eq!((wait.wake, wait.deadline), (at(10), at(1000)));
        assert_eq!(wait.extend(at(1000), MS(0)), Over::ByTheAgent);
        assert_eq!(wait.extend(at(1000), MS(300)), Over::No);
        assert_eq!((wait.wake, wait.deadline), (at(1005), at(1300)));
        assert_eq!(wait.extend(at(1300), MS(300)), Over::ByTheAgent);
        assert_eq!(wait.extend(at(4900), MS(4800)), Over::No);
        assert_eq!(wait.deadline, at(5000));
        assert_eq!(wait.extend(at(5000), MS(4001)), Over::ByTheHost);
        assert_eq!(wait.extend(at(5000), MS(4000)), Over::ByTheAgent);
    }
}
