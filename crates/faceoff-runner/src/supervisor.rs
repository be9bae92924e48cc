//! The supervisor: a watchdog thread that kills an agent if its *evaluator* (the thread that asks it questions) makes no progress. It
//! is the last defence, against unknown causes.
//!
//! The evaluator's own deadlines work as long as its thread runs. If one of its calls ever blocks on something that
//! an agent holds, no deadline of that thread can end the call, but the death of the agent does. The same thread
//! kills agents of cancelled jobs, so that no evaluator waits for an answer that is not needed any more.

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

/// Interval of the checks; a cancelled job ends within it.
const CHECK_INTERVAL: Duration = Duration::from_millis(250);
/// After a longer pause between two checks, the second one proves nothing about evaluators: the host, or this process, was stopped.
const MAX_CHECK_PAUSE: Duration = Duration::from_secs(1);
/// Time that a call of an evaluator may take beyond the end by the evaluator's own limits, before the agent is blamed.
const SLACK: Duration = Duration::from_secs(10);
/// A thread that is still blocked this long after the agent's death is stuck: something else blocks it.
const STUCK_AFTER_DEATH: Duration = Duration::from_secs(5);

/// Supervision of a job while its evaluator waits for agents.
#[derive(Clone)]
pub struct Supervision {
    cancelled: Arc<dyn Fn() -> bool + Send + Sync>,
    slack: Duration,
}

impl Supervision {
    /// Supervision of a job that can be cancelled. `cancelled` is called a few times a second.
    #[must_use]
    pub fn new(cancelled: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self {
            cancelled: Arc::new(cancelled),
            slack: SLACK,
        }
    }

    /// Replaces the slack (the time beyond the evaluator's own limits), for faster tests.
    #[must_use]
    pub fn with_slack(self, slack: Duration) -> Self {
        Self { slack, ..self }
    }
}

impl Default for Supervision {
    fn default() -> Self {
        Self::new(|| false)
    }
}

impl fmt::Debug for Supervision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Supervision")
            .field("slack", &self.slack)
            .finish_non_exhaustive()
    }
}

/// Why the supervisor killed an agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KillReason {
    /// The evaluator made no progress with it.
    Stalled,
    /// Its job was cancelled.
    Cancelled,
}

/// One agent under supervision, until dropped.
#[derive(Debug)]
pub(crate) struct SupervisedAgent(Arc<Agent>);

#[derive(Debug)]
struct Agent {
    killer: Killer,
    supervision: Supervision,
    /// Name of the evaluator's thread.
    thread: String,
    /// Deadline of the evaluator's current call, in nanoseconds since [`EPOCH`]; 0 if there is none.
    deadline_ns: AtomicU64,
    /// 0, or 1 + the [`KillReason`].
    kill_reason: AtomicU8,
    killed_at_ns: AtomicU64,
    /// The deadline that had passed at the last check; 0 if none had.
    overdue_ns: AtomicU64,
}

/// Origin of the times in [`Agent`].
static EPOCH: LazyLock<Instant> = LazyLock::new(Instant::now);
static SUPERVISOR: LazyLock<Supervisor> = LazyLock::new(Supervisor::start);

fn ns_since_epoch(instant: Instant) -> u64 {
    let elapsed_ns = instant.saturating_duration_since(*EPOCH).as_nanos();
    u64::try_from(elapsed_ns).unwrap_or(u64::MAX).max(1)
}

impl SupervisedAgent {
    pub(crate) fn new(killer: Killer, supervision: &Supervision) -> Self {
        let agent = Arc::new(Agent {
            killer,
            supervision: supervision.clone(),
            thread: thread::current().name().unwrap_or("unnamed").to_owned(),
            deadline_ns: AtomicU64::new(0),
            kill_reason: AtomicU8::new(0),
            killed_at_ns: AtomicU64::new(0),
            overdue_ns: AtomicU64::new(0),
        });
        let supervisor = &*SUPERVISOR;
        supervisor.agents().push(Arc::downgrade(&agent));
        supervisor.agent_added.notify_one();
        Self(agent)
    }

    /// Marks the calling thread as busy with the agent until the guard is dropped. `deadline` is the latest end by the thread's own
    /// limits.
    pub(crate) fn busy(&self, deadline: Instant) -> BusyGuard {
        let deadline_ns = ns_since_epoch(deadline + self.0.supervision.slack);
        self.0.deadline_ns.store(deadline_ns, Ordering::Relaxed);
        BusyGuard(Arc::clone(&self.0))
    }

    /// Why the supervisor killed the agent; `None` if it did not.
    pub(crate) fn kill_reason(&self) -> Option<KillReason> {
        self.0.kill_reason()
    }
}

/// Marks the evaluator as busy with an agent, until dropped.
#[derive(Debug)]
pub(crate) struct BusyGuard(Arc<Agent>);

impl Drop for BusyGuard {
    fn drop(&mut self) {
        self.0.deadline_ns.store(0, Ordering::Relaxed);
    }
}

impl Agent {
    fn kill_reason(&self) -> Option<KillReason> {
        match self.kill_reason.load(Ordering::Acquire) {
            0 => None,
            1 => Some(KillReason::Stalled),
            _ => Some(KillReason::Cancelled),
        }
    }

    /// Kills the agent if its job is cancelled or its evaluator is overdue. `is_recent_check`: the last check was recent enough for a
    /// verdict.
    fn check(&self, now: Instant, is_recent_check: bool) {
        let deadline_ns = self.deadline_ns.load(Ordering::Relaxed);
        if deadline_ns == 0 || self.kill_reason().is_some() {
            return;
        }
        let is_overdue = is_recent_check && ns_since_epoch(now) > deadline_ns;
        // Two overdue checks in a row are required: a stopped host may have delayed the evaluator before the first.
        let overdue_now = if is_overdue { deadline_ns } else { 0 };
        let was_overdue = self.overdue_ns.swap(overdue_now, Ordering::Relaxed) == deadline_ns;
        let reason = if (self.supervision.cancelled)() {
            KillReason::Cancelled
        } else if is_overdue && was_overdue {
            tracing::error!(
                thread = self.thread,
                "an agent blocks its evaluator: the agent is killed"
            );
            KillReason::Stalled
        } else {
            return;
        };
        self.killed_at_ns
            .store(ns_since_epoch(now), Ordering::Relaxed);
        // Stored before the kill: the evaluator continues after the kill and reads the reason.
        self.kill_reason.store(1 + reason as u8, Ordering::Release);
        self.killer.kill();
    }

    fn is_stuck(&self, now: Instant) -> bool {
        let dead_for =
            ns_since_epoch(now).saturating_sub(self.killed_at_ns.load(Ordering::Relaxed));
        self.kill_reason().is_some()
            && self.deadline_ns.load(Ordering::Relaxed) != 0
            && u128::from(dead_for) > STUCK_AFTER_DEATH.as_nanos()
    }
}

/// Names of the evaluators' threads that are still blocked seconds after their agent's death.
#[must_use]
pub fn stuck_threads() -> Vec<String> {
    let now = Instant::now();
    let agents = SUPERVISOR.agents().clone();
    let agents = agents.iter().filter_map(Weak::upgrade);
    agents
        .filter(|agent| agent.is_stuck(now))
        .map(|agent| agent.thread.clone())
        .collect()
}

struct Supervisor {
    agents: Mutex<Vec<Weak<Agent>>>,
    agent_added: Condvar,
}

impl Supervisor {
    fn start() -> Self {
        // Without a supervisor, the evaluator's own deadlines still apply.
        let started = thread::Builder::new()
            .name("supervisor".into())
            .spawn(|| SUPERVISOR.run());
        if let Err(error) = started {
            tracing::error!(%error, "no supervisor: the host has no thread left");
        }
        Self {
            agents: Mutex::default(),
            agent_added: Condvar::new(),
        }
    }

    fn agents(&self) -> MutexGuard<'_, Vec<Weak<Agent>>> {
        self.agents.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self) {
        // The first slot starts this thread and may be pinned to its own CPUs. If that slot blocks its CPUs, the
        // supervisor must still run.
        affinity::reset_to_process();
        let mut last_check = Instant::now();
        loop {
            let mut agents = self.agents();
            agents.retain(|agent| agent.strong_count() > 0);
            while agents.is_empty() {
                agents = self
                    .agent_added
                    .wait(agents)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            let all = agents.clone();
            drop(agents);
            let now = Instant::now();
            let is_recent_check = now.saturating_duration_since(last_check) < MAX_CHECK_PAUSE;
            last_check = now;
            for agent in all.iter().filter_map(Weak::upgrade) {
                agent.check(now, is_recent_check);
            }
            thread::sleep(CHECK_INTERVAL);
        }
    }
}
