//! A thread that ends agents whose evaluator makes no progress: the last line, for what nobody has thought of.
//!
//! The evaluator's own deadlines hold as long as its thread runs. Should a call of its ever wait for something
//! that an agent holds, no deadline of that thread can end it; the death of the agent does. The same thread ends
//! agents of jobs that were cancelled, so that nobody waits for an answer that nobody wants.

use faceoff_sandbox::{Killer, affinity};
use std::{
    fmt,
    sync::{
        Arc, Condvar, LazyLock, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicU8, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

/// How often the thread looks; what was cancelled ends no later than that.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// A look that comes later says nothing about evaluators: this host, or the process, stood still.
const LATE_LOOK: Duration = Duration::from_secs(1);
/// For how long past the sum of a job's limits its evaluator may make no progress.
const SLACK: Duration = Duration::from_secs(10);
/// A thread that is held for so long after the agent's death stands still: something else holds it.
const HELD_AFTER_DEATH: Duration = Duration::from_secs(5);

/// How a job is looked after while it waits for its agents.
#[derive(Clone)]
pub struct Supervision {
    cancelled: Arc<dyn Fn() -> bool + Send + Sync>,
    slack: Duration,
}

impl Supervision {
    /// Of a job that may be cancelled, as `cancelled` tells, which is asked a few times a second.
    #[must_use]
    pub fn of(cancelled: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self {
            cancelled: Arc::new(cancelled),
            slack: SLACK,
        }
    }

    /// For tests, which do not want to wait.
    #[must_use]
    pub fn with_slack(self, slack: Duration) -> Self {
        Self { slack, ..self }
    }
}

impl Default for Supervision {
    fn default() -> Self {
        Self::of(|| false)
    }
}

impl fmt::Debug for Supervision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Supervision")
            .field("slack", &self.slack)
            .finish_non_exhaustive()
    }
}

/// Why an agent was ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ended {
    /// The evaluator made no progress with it.
    Stalled,
    /// Its job was cancelled.
    Cancelled,
}

/// One agent under supervision, for as long as this lives.
#[derive(Debug)]
pub(crate) struct Supervised(Arc<Agent>);

#[derive(Debug)]
struct Agent {
    killer: Killer,
    supervision: Supervision,
    thread: String,
    /// Until when the evaluator may be busy with the agent, in nanoseconds since [`EPOCH`]; 0 while it is not.
    due_ns: AtomicU64,
    /// 0, or an [`Ended`].
    ended: AtomicU8,
    ended_ns: AtomicU64,
    /// What was overdue at the last look.
    overdue_ns: AtomicU64,
}

static EPOCH: LazyLock<Instant> = LazyLock::new(Instant::now);
static SUPERVISOR: LazyLock<Supervisor> = LazyLock::new(Supervisor::start);

fn nanoseconds(at: Instant) -> u64 {
    let since = at.saturating_duration_since(*EPOCH).as_nanos();
    u64::try_from(since).unwrap_or(u64::MAX).max(1)
}

impl Supervised {
    pub(crate) fn new(killer: Killer, supervision: &Supervision) -> Self {
        let agent = Arc::new(Agent {
            killer,
            supervision: supervision.clone(),
            thread: thread::current().name().unwrap_or("unnamed").to_owned(),
            due_ns: AtomicU64::new(0),
            ended: AtomicU8::new(0),
            ended_ns: AtomicU64::new(0),
            overdue_ns: AtomicU64::new(0),
        });
        let supervisor = &*SUPERVISOR;
        supervisor.agents().push(Arc::downgrade(&agent));
        supervisor.more.notify_one();
        Self(agent)
    }

    /// The calling thread is busy with the agent until the guard is gone, by its own limits no longer than `until`.
    pub(crate) fn busy(&self, until: Instant) -> Busy {
        let due = nanoseconds(until + self.0.supervision.slack);
        self.0.due_ns.store(due, Ordering::Relaxed);
        Busy(Arc::clone(&self.0))
    }

    /// Was it ended from here?
    pub(crate) fn ended(&self) -> Option<Ended> {
        self.0.ended()
    }
}

/// As long as it lives, the evaluator is busy with an agent.
#[derive(Debug)]
pub(crate) struct Busy(Arc<Agent>);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.due_ns.store(0, Ordering::Relaxed);
    }
}

impl Agent {
    fn ended(&self) -> Option<Ended> {
        match self.ended.load(Ordering::Acquire) {
            0 => None,
            1 => Some(Ended::Stalled),
            _ => Some(Ended::Cancelled),
        }
    }

    /// `in_time`: the last look was not long ago.
    fn look(&self, now: Instant, in_time: bool) {
        let due_ns = self.due_ns.load(Ordering::Relaxed);
        if due_ns == 0 || self.ended().is_some() {
            return;
        }
        let is_overdue = in_time && nanoseconds(now) > due_ns;
        // Twice in a row: what kept the evaluator from going on may have been a host that stood still.
        let seen = if is_overdue { due_ns } else { 0 };
        let was_overdue = self.overdue_ns.swap(seen, Ordering::Relaxed) == due_ns;
        let why = if (self.supervision.cancelled)() {
            Ended::Cancelled
        } else if is_overdue && was_overdue {
            tracing::error!(
                thread = self.thread,
                "an agent holds its evaluator: it is ended"
            );
            Ended::Stalled
        } else {
            return;
        };
        self.ended_ns.store(nanoseconds(now), Ordering::Relaxed);
        // Before the kill: whoever goes on by it looks for the reason.
        self.ended.store(1 + why as u8, Ordering::Release);
        self.killer.kill();
    }

    fn stands_still(&self, now: Instant) -> bool {
        let dead_for = nanoseconds(now).saturating_sub(self.ended_ns.load(Ordering::Relaxed));
        self.ended().is_some()
            && self.due_ns.load(Ordering::Relaxed) != 0
            && u128::from(dead_for) > HELD_AFTER_DEATH.as_nanos()
    }
}

/// The threads that are still held by something after their agent's death, by name.
#[must_use]
pub fn standing_still() -> Vec<String> {
    let now = Instant::now();
    let agents = SUPERVISOR.agents().clone();
    let agents = agents.iter().filter_map(Weak::upgrade);
    agents
        .filter(|agent| agent.stands_still(now))
        .map(|agent| agent.thread.clone())
        .collect()
}

struct Supervisor {
    agents: Mutex<Vec<Weak<Agent>>>,
    more: Condvar,
}

impl Supervisor {
    fn start() -> Self {
        // Without it nothing is worse than it was: the evaluator's own deadlines hold.
        let started = thread::Builder::new()
            .name("supervisor".into())
            .spawn(|| SUPERVISOR.run());
        if let Err(error) = started {
            tracing::error!(%error, "no supervisor: the host has no thread left");
        }
        Self {
            agents: Mutex::default(),
            more: Condvar::new(),
        }
    }

    fn agents(&self) -> MutexGuard<'_, Vec<Weak<Agent>>> {
        self.agents.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self) {
        // Started by the first slot, which keeps to CPUs of its own: should it be held there, this must not be.
        affinity::as_the_process();
        let mut last_look = Instant::now();
        loop {
            let mut agents = self.agents();
            agents.retain(|agent| agent.strong_count() > 0);
            while agents.is_empty() {
                agents = self
                    .more
                    .wait(agents)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            let all = agents.clone();
            drop(agents);
            let now = Instant::now();
            let in_time = now.saturating_duration_since(last_look) < LATE_LOOK;
            last_look = now;
            for agent in all.iter().filter_map(Weak::upgrade) {
                agent.look(now, in_time);
            }
            thread::sleep(LOOK_EVERY);
        }
    }
}
