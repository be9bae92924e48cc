//! Run delay of an agent's threads: how long they were ready to run (runnable) and did not run. A sleeping thread has no run delay.
//!
//! Only a bounded number of threads is sampled, so that a sample costs the same for any number of threads.

use crate::sched_stat::SchedStat;
use rustix::process::Pid;
use std::{
    collections::BTreeMap,
    fs::{self, File},
    os::unix::fs::FileExt,
    time::Duration,
};

/// One sample of the tracked threads: how long each has waited for a CPU so far, and whether it waits now.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct ThreadWaits {
    /// By thread id.
    threads: BTreeMap<u32, ThreadState>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ThreadState {
    run_time: Duration,
    /// Time on the run queue, up to its last time slice.
    wait_time: Duration,
    /// Number of time slices.
    time_slices: u64,
    /// It runs or waits to run now.
    is_runnable: bool,
    /// Its scheduling policy (`SCHED_BATCH`, `SCHED_IDLE`) yields to other threads, so the agent itself chose its
    /// waits.
    is_background: bool,
}

impl ThreadWaits {
    /// One thread, which sleeps now.
    #[cfg(test)]
    pub(crate) fn one_thread(run_time: Duration, wait_time: Duration) -> Self {
        // A thread that ran longer had more time slices.
        let time_slices = u64::try_from(run_time.as_nanos()).unwrap_or(u64::MAX);
        Self::single(run_time, wait_time, time_slices, false)
    }

    /// One thread with this number of time slices.
    #[cfg(test)]
    pub(crate) fn one_thread_with_slices(time_slices: u64, is_runnable: bool) -> Self {
        Self::single(Duration::ZERO, Duration::ZERO, time_slices, is_runnable)
    }

    #[cfg(test)]
    fn single(
        run_time: Duration,
        wait_time: Duration,
        time_slices: u64,
        is_runnable: bool,
    ) -> Self {
        let thread = ThreadState {
            run_time,
            wait_time,
            time_slices,
            is_runnable,
            is_background: false,
        };
        Self {
            threads: BTreeMap::from([(1, thread)]),
        }
    }
}

/// The waits of each thread that could have delayed an answer, updated by samples while the answer is late. If a thread got the CPU,
/// went to sleep and did not answer, its earlier waits do not count.
#[derive(Debug, Clone, Default)]
pub(crate) struct WaitLedger(BTreeMap<u32, LedgerEntry>);

#[derive(Debug, Clone, Copy, Default)]
struct LedgerEntry {
    /// The part of its wait counter that does not count: its value when the thread was last found to have finished its
    /// work, and zero before.
    discarded_wait: Duration,
    /// Time between successive samples that both found it waiting.
    observed_wait: Duration,
    /// The thread's number of time slices at the last sample that found it waiting.
    time_slices: u64,
    /// Was it asleep in the last sample?
    was_asleep: bool,
}

/// State of a late answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnswerState {
    /// The answer has arrived: a thread that has not run since did not contribute to it.
    Received,
    /// The answer may still arrive.
    Pending,
}

impl WaitLedger {
    #[cfg(test)]
    pub(crate) const EMPTY: Self = Self(BTreeMap::new());

    /// Adds a sample without an answer. `idle_between`: the time since the last sample in which none of the agent's threads ran.
    pub(crate) fn add(
        &mut self,
        previous: &ThreadWaits,
        now: &ThreadWaits,
        idle_between: Duration,
    ) {
        for (id, thread) in &now.threads {
            let entry = self.0.entry(*id).or_default();
            let earlier = previous.threads.get(id);
            // If it had slept in between, waking up would have cost a time slice.
            if earlier.is_some_and(|earlier| {
                earlier.is_runnable && earlier.time_slices == thread.time_slices
            }) && thread.is_runnable
            {
                entry.observed_wait += idle_between;
                entry.time_slices = thread.time_slices;
            }
            entry.update(thread);
        }
    }

    /// Starts with the first sample, `now`. `before`: the counters that were read before the question. `stolen`: steal time since then, in
    /// which the hypervisor had stopped the agent's CPUs. A runnable thread without a time slice since then may have slept in between, so
    /// at most the steal time counts as its wait.
    pub(crate) fn begin(&mut self, before: &ThreadWaits, now: &ThreadWaits, stolen: Duration) {
        for (id, thread) in &now.threads {
            let entry = self.0.entry(*id).or_default();
            let earlier = before.threads.get(id);
            if thread.is_runnable
                && earlier.is_some_and(|earlier| earlier.time_slices == thread.time_slices)
            {
                entry.observed_wait += stolen;
                entry.time_slices = thread.time_slices;
            }
            entry.update(thread);
        }
    }

    /// The longest observed wait of a single thread.
    pub(crate) fn longest_observed_wait(&self, now: &ThreadWaits, answer: AnswerState) -> Duration {
        let each = self.0.iter().filter_map(|(id, entry)| {
            let thread = now.threads.get(id)?;
            let ran_since = thread.time_slices != entry.time_slices;
            (!thread.is_background && (ran_since || answer == AnswerState::Pending))
                .then_some(entry.observed_wait)
        });
        each.max().unwrap_or_default()
    }

    fn discarded_wait(&self, id: u32) -> Duration {
        self.0
            .get(&id)
            .map_or(Duration::ZERO, |entry| entry.discarded_wait)
    }
}

impl LedgerEntry {
    /// Two successive samples that find it asleep show that it has finished its work; earlier waits no longer count.
    fn update(&mut self, thread: &ThreadState) {
        let is_asleep = !thread.is_runnable;
        if is_asleep && self.was_asleep {
            self.discarded_wait = thread.wait_time;
            self.observed_wait = Duration::ZERO;
        }
        self.was_asleep = is_asleep;
    }
}

impl ThreadWaits {
    /// The longest countable wait of a thread since the sample `earlier`, which was taken `elapsed` ago.
    pub(crate) fn longest_since(
        &self,
        earlier: &Self,
        elapsed: Duration,
        ledger: &WaitLedger,
        answer: AnswerState,
    ) -> Duration {
        let countable_wait = |(id, now): (&u32, &ThreadState)| {
            // Nothing is known about a thread that was not tracked before.
            let earlier = earlier.threads.get(id)?;
            let counted_from = ledger.discarded_wait(*id).max(earlier.wait_time);
            if now.is_background {
                return None;
            }
            if now.time_slices == earlier.time_slices {
                // The kernel adds a current wait to the counter only when the wait ends.
                let is_waiting = now.is_runnable
                    && now.run_time == earlier.run_time
                    && counted_from == earlier.wait_time;
                return (is_waiting && answer == AnswerState::Pending).then_some(elapsed);
            }
            Some(now.wait_time.saturating_sub(counted_from))
        };
        let each = self.threads.iter().filter_map(countable_wait);
        each.max().unwrap_or_default().min(elapsed)
    }
}

/// Open counter files of an agent's first threads: reading one costs a microsecond.
#[derive(Debug, Default)]
pub(crate) struct TrackedThreads {
    threads: Vec<TrackedThread>,
    processes: Vec<Pid>,
}

#[derive(Debug)]
struct TrackedThread {
    id: u32,
    schedule: File,
    status: File,
}

impl TrackedThreads {
    /// More threads would make every sample more expensive, and the first ones are those that answer.
    const MAX_THREADS: usize = 16;

    /// Tracks the threads that these processes have now.
    pub(crate) fn update(&mut self, processes: &[Pid]) {
        self.processes.clear();
        let mut tracked = std::mem::take(&mut self.threads);
        for process in processes {
            if self.threads.len() >= Self::MAX_THREADS {
                return;
            }
            self.processes.push(*process);
            let tasks = format!("/proc/{}/task", process.as_raw_nonzero());
            // The folder is missing if the process has just ended.
            for task in fs::read_dir(tasks).into_iter().flatten().flatten() {
                if self.threads.len() >= Self::MAX_THREADS {
                    return;
                }
                let Ok(id) = task.file_name().to_string_lossy().parse() else {
                    continue;
                };
                let index = tracked.iter().position(|thread| thread.id == id);
                let thread = match index {
                    // The id may have been reused by another thread: then the old files can no longer be read.
                    Some(index) if tracked[index].counters().is_some() => {
                        Some(tracked.swap_remove(index))
                    }
                    _ => TrackedThread::open(id, &task.path()),
                };
                self.threads.extend(thread);
            }
        }
    }

    /// The processes of the tracked threads.
    pub(crate) fn processes(&self) -> &[Pid] {
        &self.processes
    }

    /// Reads their counters, without whether they are runnable.
    pub(crate) fn read_counters(&self) -> Option<ThreadWaits> {
        self.read(|thread| thread.counters())
    }

    /// Reads their counters and states; `None` if the kernel was built without such counters.
    pub(crate) fn sample(&self) -> Option<ThreadWaits> {
        self.read(TrackedThread::sample)
    }

    fn read(
        &self,
        read_thread: impl Fn(&TrackedThread) -> Option<ThreadState>,
    ) -> Option<ThreadWaits> {
        let each = self.threads.iter();
        let threads: BTreeMap<u32, ThreadState> = each
            .filter_map(|thread| Some((thread.id, read_thread(thread)?)))
            .collect();
        (!threads.is_empty()).then_some(ThreadWaits { threads })
    }
}

impl TrackedThread {
    fn open(id: u32, task: &std::path::Path) -> Option<Self> {
        let open = |name| File::open(task.join(name)).ok();
        Some(Self {
            id,
            schedule: open("schedstat")?,
            status: open("stat")?,
        })
    }

    /// `None` if the thread has ended.
    fn counters(&self) -> Option<ThreadState> {
        SchedStat::read(&self.schedule).map(ThreadState::from_counters)
    }

    fn sample(&self) -> Option<ThreadState> {
        // Read the state first: if the thread runs, sleeps and wakes up in between, its number of slices changes.
        let mut status = [0; 1024];
        let count = self.status.read_at(&mut status, 0).ok()?;
        with_state(&String::from_utf8_lossy(&status[..count]), self.counters()?)
    }
}

impl ThreadState {
    const fn from_counters(counters: SchedStat) -> Self {
        let SchedStat {
            run_time,
            wait_time,
            time_slices,
        } = counters;
        Self {
            run_time,
            wait_time,
            time_slices,
            is_runnable: false,
            is_background: false,
        }
    }
}

/// Adds state and policy from the text of `stat`: number, name, state, and much later the policy.
fn with_state(status: &str, thread: ThreadState) -> Option<ThreadState> {
    /// Index of the policy, counted from the state. In the whole line the state is field 3, the policy field 41.
    const POLICY_INDEX: usize = 41 - 3;
    const BATCH: &str = "3";
    const IDLE: &str = "5";
    // The second field is the program's name in parentheses, which may contain anything.
    let (_, rest) = status.rsplit_once(')')?;
    let mut fields = rest.split_ascii_whitespace();
    let state = fields.next()?;
    let policy = fields.nth(POLICY_INDEX - 1);
    Some(ThreadState {
        is_runnable: state.starts_with('R'),
        is_background: policy.is_some_and(|policy| [BATCH, IDLE].contains(&policy)),
        ..thread
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Duration = Duration::from_nanos(1000);
    /// `NS(5)` is 5 nanoseconds.
    const NS: fn(u64) -> Duration = Duration::from_nanos;

    /// Each thread: its number, its `schedstat` (run time in ns, wait time in ns, time slices), its state (`R` runnable, `S` asleep)
    /// and its policy (0 normal, 3 batch, 5 idle).
    fn waits(threads: &[(u32, &str, &str, &str)]) -> ThreadWaits {
        let parse = |&(id, schedule, state, policy): &(u32, &str, &str, &str)| {
            let skipped_fields = "0 ".repeat(37);
            let status = format!("{id} (a) b) {state} {skipped_fields}{policy} 0");
            let counters = ThreadState::from_counters(SchedStat::parse(schedule).unwrap());
            (id, with_state(&status, counters).unwrap())
        };
        ThreadWaits {
            threads: threads.iter().map(parse).collect(),
        }
    }

    #[test]
    fn waits_count_only_for_threads_that_ran_afterwards() {
        let baseline = waits(&[(1, "500 100 3", "S", "0"), (2, "70 0 1", "R", "0")]);
        let ledger = WaitLedger::default();
        let longest = |threads, answer| {
            let now = waits(threads);
            now.longest_since(&baseline, WALL, &ledger, answer)
        };
        use AnswerState::{Pending, Received};
        for answer in [Received, Pending] {
            let longest = |threads| longest(threads, answer).as_nanos();
            assert_eq!(
                longest(&[(1, "500 100 3", "S", "0")]),
                0,
                "the thread slept"
            );
            assert_eq!(longest(&[(1, "510 400 4", "S", "0")]), 300);
            assert_eq!(longest(&[(1, "510 9000 4", "S", "0")]), 1000);
            assert_eq!(
                longest(&[(1, "510 400 4", "S", "5")]),
                0,
                "its policy is SCHED_IDLE"
            );
            assert_eq!(
                longest(&[(1, "510 400 4", "S", "3")]),
                0,
                "its policy is SCHED_BATCH"
            );
            assert_eq!(longest(&[(2, "75 20 2", "S", "0")]), 20);
            assert_eq!(
                longest(&[(3, "5 40 2", "R", "0")]),
                0,
                "the thread was not tracked"
            );
            assert_eq!(longest(&[]), 0);
        }
        let waiting: &[_] = &[(2, "70 0 1", "R", "0")];
        assert_eq!(longest(waiting, Pending), WALL, "the thread never ran");
        assert_eq!(
            longest(waiting, Received),
            NS(0),
            "the answer came without it"
        );
    }

    #[test]
    fn sleep_after_a_wait_discards_it() {
        let samples = [
            waits(&[(1, "500 100 3", "R", "0")]),
            waits(&[(1, "500 100 3", "R", "0")]),
            waits(&[(1, "510 400 4", "S", "0")]),
            waits(&[(1, "520 450 5", "S", "0")]),
        ];
        let answer = waits(&[(1, "530 470 6", "S", "0")]);
        let mut ledger = WaitLedger::default();
        let counts = |ledger: &WaitLedger| {
            let wait_time = answer.longest_since(&samples[0], WALL, ledger, AnswerState::Received);
            let observed_wait = ledger.longest_observed_wait(&answer, AnswerState::Received);
            (wait_time.as_nanos(), observed_wait.as_nanos())
        };
        ledger.add(&samples[0], &samples[1], NS(50));
        assert_eq!(counts(&ledger), (370, 50));
        ledger.add(&samples[1], &samples[2], NS(50));
        assert_eq!(counts(&ledger), (370, 50), "asleep once");
        ledger.add(&samples[2], &samples[3], NS(50));
        assert_eq!(counts(&ledger), (20, 0), "asleep twice");
    }

    #[test]
    fn waits_of_many_threads_do_not_add_up() {
        // At each pair of samples another one of eight threads waits.
        let sample = |number: u64| {
            let each: Vec<(u32, String, &str)> = (0..8)
                .map(|id: u64| {
                    let time_slices = number.saturating_sub(id) / 8;
                    let state = if (number / 2) % 8 == id { "R" } else { "S" };
                    (id as u32, format!("{time_slices} 0 {time_slices}"), state)
                })
                .collect();
            let each: Vec<_> = each
                .iter()
                .map(|(id, schedule, state)| (*id, schedule.as_str(), *state, "0"))
                .collect();
            waits(&each)
        };
        let mut ledger = WaitLedger::default();
        for number in 0..100 {
            ledger.add(&sample(number), &sample(number + 1), NS(5));
        }
        assert!(ledger.longest_observed_wait(&sample(200), AnswerState::Received) <= NS(10));
    }

    #[test]
    fn first_sample_counts_the_steal_time() {
        let baseline = waits(&[(1, "500 100 3", "S", "0")]);
        let now = |threads| {
            let mut ledger = WaitLedger::default();
            let now = waits(threads);
            ledger.begin(&baseline, &now, NS(40));
            ledger
                .longest_observed_wait(&now, AnswerState::Pending)
                .as_nanos()
        };
        assert_eq!(now(&[(1, "500 100 3", "R", "0")]), 40);
        assert_eq!(now(&[(1, "500 100 3", "S", "0")]), 0, "the thread sleeps");
        assert_eq!(now(&[(1, "501 100 4", "R", "0")]), 0, "the thread ran");
        assert_eq!(
            now(&[(1, "500 100 3", "R", "5")]),
            0,
            "its policy is SCHED_IDLE"
        );
    }

    #[test]
    fn tracked_threads_are_bounded() {
        const EXTRA_THREADS: usize = 40;
        let end_barrier = std::sync::Barrier::new(EXTRA_THREADS + 1);
        std::thread::scope(|scope| {
            for _ in 0..EXTRA_THREADS {
                scope.spawn(|| end_barrier.wait());
            }
            let this = rustix::process::getpid();
            let mut tracked = TrackedThreads::default();
            tracked.update(&[this]);
            let waits = tracked.sample().expect("this kernel counts waits");
            assert!(waits.threads.len() <= TrackedThreads::MAX_THREADS);
            assert!(
                tracked
                    .read_counters()
                    .is_some_and(|read_counters| !read_counters.threads.is_empty())
            );
            assert_eq!(tracked.processes(), [this]);
            // Tracked threads stay tracked.
            tracked.update(&[this]);
            assert!(tracked.sample().is_some());
            tracked.update(&[]);
            assert_eq!((tracked.sample(), tracked.read_counters()), (None, None));
            end_barrier.wait();
        });
    }
}
