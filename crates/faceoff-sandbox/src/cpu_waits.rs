//! How long the threads of an agent wanted to run and were not let: who sleeps is not kept from anything
//! by what others run meanwhile.
//!
//! Only a bounded number of threads is looked at, so that a look costs the same however many an agent has.

use crate::sched_stat::SchedStat;
use rustix::process::Pid;
use std::{
    collections::BTreeMap,
    fs::{self, File},
    os::unix::fs::FileExt,
    time::Duration,
};

/// Of each known thread, at one time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Waits {
    threads: BTreeMap<u32, Thread>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Thread {
    ran: Duration,
    /// Up to when it was last let run.
    waited: Duration,
    /// How often it was let run.
    slices: u64,
    /// It runs or waits to run now.
    wants_to_run: bool,
    /// Of a policy whose threads take what nobody else wants, so that their waits are of their own choice.
    gives_way: bool,
}

impl Waits {
    /// Of one thread, which sleeps now.
    #[cfg(test)]
    pub(crate) fn of_one_thread(ran: Duration, waited: Duration) -> Self {
        // What ran more was let run more often.
        let slices = u64::try_from(ran.as_nanos()).unwrap_or(u64::MAX);
        Self::of_one(ran, waited, slices, false)
    }

    /// Of one thread that was let run so often.
    #[cfg(test)]
    pub(crate) fn of_one_thread_let(slices: u64, wants_to_run: bool) -> Self {
        Self::of_one(Duration::ZERO, Duration::ZERO, slices, wants_to_run)
    }

    #[cfg(test)]
    fn of_one(ran: Duration, waited: Duration, slices: u64, wants_to_run: bool) -> Self {
        let thread = Thread {
            ran,
            waited,
            slices,
            wants_to_run,
            gives_way: false,
        };
        Self {
            threads: BTreeMap::from([(1, thread)]),
        }
    }
}

/// Whose waits could have kept an answer, as looks tell while it is late: of a thread that was let run, went to
/// sleep and left the answer to be waited for, what it waited for before does not count.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ledger(BTreeMap<u32, Account>);

#[derive(Debug, Clone, Copy, Default)]
struct Account {
    /// Its counter of waits, from where on they count; zero as long as all of them do.
    from: Duration,
    /// For how long two looks in a row found it waiting, and how often it had been let run then.
    unlet: Duration,
    slices: u64,
    was_asleep: bool,
}

/// Whether the answer is there for which a late agent was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnswerState {
    /// The answer is there: who was not let run since has not contributed to it.
    Taken,
    /// It may still come.
    Pending,
}

impl Ledger {
    #[cfg(test)]
    pub(crate) const NONE: Self = Self(BTreeMap::new());

    /// A look without an answer, `between` after the last one, of which none of the agent's threads ran.
    pub(crate) fn add(&mut self, before: &Waits, now: &Waits, between: Duration) {
        for (id, thread) in &now.threads {
            let account = self.0.entry(*id).or_default();
            let then = before.threads.get(id);
            // Had it slept in between, it would have been let run to wake.
            if then.is_some_and(|then| then.wants_to_run && then.slices == thread.slices)
                && thread.wants_to_run
            {
                account.unlet += between;
                account.slices = thread.slices;
            }
            account.settle(thread);
        }
    }

    /// The first look, `stolen` since a glance before the question: who wants to run and was not let since may
    /// have slept until now, but not longer than there was no CPU.
    pub(crate) fn begin(&mut self, glance: &Waits, now: &Waits, stolen: Duration) {
        for (id, thread) in &now.threads {
            let account = self.0.entry(*id).or_default();
            let then = glance.threads.get(id);
            if thread.wants_to_run && then.is_some_and(|then| then.slices == thread.slices) {
                account.unlet += stolen;
                account.slices = thread.slices;
            }
            account.settle(thread);
        }
    }

    /// For how long one and the same thread was seen waiting.
    pub(crate) fn longest_unlet(&self, now: &Waits, answer: AnswerState) -> Duration {
        let each = self.0.iter().filter_map(|(id, account)| {
            let thread = now.threads.get(id)?;
            let ran_since = thread.slices != account.slices;
            (!thread.gives_way && (ran_since || answer == AnswerState::Pending))
                .then_some(account.unlet)
        });
        each.max().unwrap_or_default()
    }

    fn from(&self, id: u32) -> Duration {
        self.0.get(&id).map_or(Duration::ZERO, |one| one.from)
    }
}

impl Account {
    /// Two looks in a row that find it asleep say that it has done what it was let run for.
    fn settle(&mut self, thread: &Thread) {
        let is_asleep = !thread.wants_to_run;
        if is_asleep && self.was_asleep {
            self.from = thread.waited;
            self.unlet = Duration::ZERO;
        }
        self.was_asleep = is_asleep;
    }
}

impl Waits {
    /// The longest wait of a thread since `before`, which was `wall` ago, as far as it counts.
    pub(crate) fn longest_since(
        &self,
        before: &Self,
        wall: Duration,
        ledger: &Ledger,
        answer: AnswerState,
    ) -> Duration {
        let since = |(id, now): (&u32, &Thread)| {
            // Of a thread that was not known nothing follows.
            let then = before.threads.get(id)?;
            let from = ledger.from(*id).max(then.waited);
            if now.gives_way {
                return None;
            }
            if now.slices == then.slices {
                // The wait that it is in is added to the counter when it ends.
                let waits = now.wants_to_run && now.ran == then.ran && from == then.waited;
                return (waits && answer == AnswerState::Pending).then_some(wall);
            }
            Some(now.waited.saturating_sub(from))
        };
        let each = self.threads.iter().filter_map(since);
        each.max().unwrap_or_default().min(wall)
    }
}

/// The counters of an agent's first threads, held open: to read them costs a microsecond each.
#[derive(Debug, Default)]
pub(crate) struct KnownThreads {
    threads: Vec<KnownThread>,
    processes: Vec<Pid>,
}

#[derive(Debug)]
struct KnownThread {
    id: u32,
    schedule: File,
    status: File,
}

impl KnownThreads {
    /// More of them make every look dearer; the first ones are those that answer.
    const MOST: usize = 16;

    /// Those that these processes have now.
    pub(crate) fn update(&mut self, processes: &[Pid]) {
        self.processes.clear();
        let mut known = std::mem::take(&mut self.threads);
        for process in processes {
            if self.threads.len() >= Self::MOST {
                return;
            }
            self.processes.push(*process);
            let tasks = format!("/proc/{}/task", process.as_raw_nonzero());
            // A process or thread that has just ended has none.
            for task in fs::read_dir(tasks).into_iter().flatten().flatten() {
                if self.threads.len() >= Self::MOST {
                    return;
                }
                let Ok(id) = task.file_name().to_string_lossy().parse() else {
                    continue;
                };
                let at = known.iter().position(|thread| thread.id == id);
                let thread = match at {
                    // Another thread of the same number has other files: these tell nothing any more.
                    Some(at) if known[at].counters().is_some() => Some(known.swap_remove(at)),
                    _ => KnownThread::open(id, &task.path()),
                };
                self.threads.extend(thread);
            }
        }
    }

    /// The processes that they are of.
    pub(crate) fn processes(&self) -> &[Pid] {
        &self.processes
    }

    /// Their counters now. Whether one wants to run is not among them.
    pub(crate) fn glance(&self) -> Option<Waits> {
        self.read(|thread| thread.counters())
    }

    /// Their counters now, and what they want; `None` if the kernel tells nothing at all, as one does that was
    /// built without that.
    pub(crate) fn look(&self) -> Option<Waits> {
        self.read(KnownThread::look)
    }

    fn read(&self, look: impl Fn(&KnownThread) -> Option<Thread>) -> Option<Waits> {
        let each = self.threads.iter();
        let threads: BTreeMap<u32, Thread> = each
            .filter_map(|thread| Some((thread.id, look(thread)?)))
            .collect();
        (!threads.is_empty()).then_some(Waits { threads })
    }
}

impl KnownThread {
    fn open(id: u32, task: &std::path::Path) -> Option<Self> {
        let open = |name| File::open(task.join(name)).ok();
        Some(Self {
            id,
            schedule: open("schedstat")?,
            status: open("stat")?,
        })
    }

    /// `None` of a thread that has ended.
    fn counters(&self) -> Option<Thread> {
        SchedStat::read(&self.schedule).map(Thread::of)
    }

    fn look(&self) -> Option<Thread> {
        // The state first: one that is let run, sleeps and is woken has another number of slices then.
        let mut status = [0; 1024];
        let count = self.status.read_at(&mut status, 0).ok()?;
        wishes(&String::from_utf8_lossy(&status[..count]), self.counters()?)
    }
}

impl Thread {
    const fn of(counters: SchedStat) -> Self {
        let SchedStat {
            ran,
            waited,
            slices,
        } = counters;
        Self {
            ran,
            waited,
            slices,
            wants_to_run: false,
            gives_way: false,
        }
    }
}

/// What `stat` tells of it: number, name, state, and much later the policy.
fn wishes(status: &str, thread: Thread) -> Option<Thread> {
    /// Counted from the state, which is the third field of all.
    const POLICY: usize = 41 - 3;
    const BATCH: &str = "3";
    const IDLE: &str = "5";
    // The name is the program's, and may hold anything.
    let (_, rest) = status.rsplit_once(')')?;
    let mut fields = rest.split_ascii_whitespace();
    let state = fields.next()?;
    let policy = fields.nth(POLICY - 1);
    Some(Thread {
        wants_to_run: state.starts_with('R'),
        gives_way: policy.is_some_and(|policy| [BATCH, IDLE].contains(&policy)),
        ..thread
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Duration = Duration::from_nanos(1000);
    const NS: fn(u64) -> Duration = Duration::from_nanos;

    /// Of each thread its number, its `schedstat`, its state, and its policy.
    fn waits(threads: &[(u32, &str, &str, &str)]) -> Waits {
        let of = |&(id, schedule, state, policy): &(u32, &str, &str, &str)| {
            let between = "0 ".repeat(37);
            let status = format!("{id} (a) b) {state} {between}{policy} 0");
            {
                let counters = Thread::of(SchedStat::parse(schedule).unwrap());
                (id, wishes(&status, counters).unwrap())
            }
        };
        Waits {
            threads: threads.iter().map(of).collect(),
        }
    }

    #[test]
    fn only_threads_that_ran_towards_the_answer_were_kept_from_it() {
        let before = waits(&[(1, "500 100 3", "S", "0"), (2, "70 0 1", "R", "0")]);
        let ledger = Ledger::default();
        let longest = |threads, answer| {
            let now = waits(threads);
            now.longest_since(&before, WALL, &ledger, answer)
        };
        use AnswerState::{Pending, Taken};
        for answer in [Taken, Pending] {
            let longest = |threads| longest(threads, answer).as_nanos();
            assert_eq!(longest(&[(1, "500 100 3", "S", "0")]), 0, "it slept");
            assert_eq!(longest(&[(1, "510 400 4", "S", "0")]), 300);
            assert_eq!(longest(&[(1, "510 9000 4", "S", "0")]), 1000);
            assert_eq!(
                longest(&[(1, "510 400 4", "S", "5")]),
                0,
                "it takes leavings"
            );
            assert_eq!(
                longest(&[(1, "510 400 4", "S", "3")]),
                0,
                "it is in no hurry"
            );
            assert_eq!(longest(&[(2, "75 20 2", "S", "0")]), 20);
            assert_eq!(longest(&[(3, "5 40 2", "R", "0")]), 0, "it is not known");
            assert_eq!(longest(&[]), 0);
        }
        let waiting: &[_] = &[(2, "70 0 1", "R", "0")];
        assert_eq!(longest(waiting, Pending), WALL, "not once let run");
        assert_eq!(longest(waiting, Taken), NS(0), "the answer came without it");
    }

    #[test]
    fn sleep_after_a_wait_forfeits_it() {
        let looks = [
            waits(&[(1, "500 100 3", "R", "0")]),
            waits(&[(1, "500 100 3", "R", "0")]),
            waits(&[(1, "510 400 4", "S", "0")]),
            waits(&[(1, "520 450 5", "S", "0")]),
        ];
        let answer = waits(&[(1, "530 470 6", "S", "0")]);
        let mut ledger = Ledger::default();
        let counts = |ledger: &Ledger| {
            let waited = answer.longest_since(&looks[0], WALL, ledger, AnswerState::Taken);
            let unlet = ledger.longest_unlet(&answer, AnswerState::Taken);
            (waited.as_nanos(), unlet.as_nanos())
        };
        ledger.add(&looks[0], &looks[1], NS(50));
        assert_eq!(counts(&ledger), (370, 50));
        ledger.add(&looks[1], &looks[2], NS(50));
        assert_eq!(counts(&ledger), (370, 50), "asleep once");
        ledger.add(&looks[2], &looks[3], NS(50));
        assert_eq!(counts(&ledger), (20, 0), "asleep twice");
    }

    #[test]
    fn waits_of_many_threads_do_not_add_up() {
        // Of eight threads another one waits at each pair of looks.
        let look = |number: u64| {
            let each: Vec<(u32, String, &str)> = (0..8)
                .map(|id: u64| {
                    let slices = number.saturating_sub(id) / 8;
                    let state = if (number / 2) % 8 == id { "R" } else { "S" };
                    (id as u32, format!("{slices} 0 {slices}"), state)
                })
                .collect();
            let each: Vec<_> = each
                .iter()
                .map(|(id, schedule, state)| (*id, schedule.as_str(), *state, "0"))
                .collect();
            waits(&each)
        };
        let mut ledger = Ledger::default();
        for number in 0..100 {
            ledger.add(&look(number), &look(number + 1), NS(5));
        }
        assert!(ledger.longest_unlet(&look(200), AnswerState::Taken) <= NS(10));
    }

    #[test]
    fn a_first_look_believes_what_was_stolen() {
        let glance = waits(&[(1, "500 100 3", "S", "0")]);
        let now = |threads| {
            let mut ledger = Ledger::default();
            let now = waits(threads);
            ledger.begin(&glance, &now, NS(40));
            ledger.longest_unlet(&now, AnswerState::Pending).as_nanos()
        };
        assert_eq!(now(&[(1, "500 100 3", "R", "0")]), 40);
        assert_eq!(now(&[(1, "500 100 3", "S", "0")]), 0, "it sleeps");
        assert_eq!(now(&[(1, "501 100 4", "R", "0")]), 0, "it was let run");
        assert_eq!(now(&[(1, "500 100 3", "R", "5")]), 0, "it takes leavings");
    }

    #[test]
    fn the_kernel_tells_of_a_bounded_number_of_threads() {
        let over = std::sync::Barrier::new(41);
        std::thread::scope(|scope| {
            for _ in 0..40 {
                scope.spawn(|| over.wait());
            }
            let this = rustix::process::getpid();
            let mut known = KnownThreads::default();
            known.update(&[this]);
            let waits = known.look().expect("this kernel counts waits");
            assert!(waits.threads.len() <= KnownThreads::MOST);
            assert!(
                known
                    .glance()
                    .is_some_and(|glance| !glance.threads.is_empty())
            );
            assert_eq!(known.processes(), [this]);
            // What was known stays known.
            known.update(&[this]);
            assert!(known.look().is_some());
            known.update(&[]);
            assert_eq!((known.look(), known.glance()), (None, None));
            over.wait();
        });
    }
}
