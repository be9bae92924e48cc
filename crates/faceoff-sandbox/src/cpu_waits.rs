//! How long the threads of an agent wanted to run and were not let: who sleeps is not kept from anything
//! by what others run meanwhile.

use rustix::process::Pid;
use std::{
    collections::BTreeMap,
    fs::{self, File},
    os::unix::fs::FileExt,
    time::Duration,
};

/// Of each thread, at one time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Waits {
    threads: BTreeMap<u32, Thread>,
    of: Which,
}

/// Whose waits were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Which {
    /// Of all threads: one that is new later was born since.
    All,
    /// Of those that were known: nothing follows for others.
    Known,
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
}

impl Waits {
    /// What the kernel tells of all threads of these processes; `None` if it tells nothing at all, as one
    /// does that was built without that.
    pub(crate) fn read(processes: &[Pid]) -> Option<Self> {
        let mut threads = BTreeMap::new();
        for_each_task(processes, |id, task| {
            let of = |file| fs::read_to_string(task.join(file)).ok();
            // The state first: one that is let run, sleeps and is woken has another number of slices then.
            if let (Some(status), Some(schedule)) = (of("stat"), of("schedstat")) {
                threads.extend(thread(&schedule, &status).map(|thread| (id, thread)));
            }
        });
        let of = Which::All;
        (!threads.is_empty()).then_some(Self { threads, of })
    }

    /// Of one thread, which sleeps now.
    #[cfg(test)]
    pub(crate) fn of_one_thread(ran: Duration, waited: Duration) -> Self {
        let counters = Counters {
            ran,
            waited,
            slices: 0,
        };
        Self {
            threads: BTreeMap::from([(1, counters.of(false))]),
            of: Which::All,
        }
    }

    /// Of one thread that was let run so often.
    #[cfg(test)]
    pub(crate) fn of_one_thread_let(slices: u64, wants_to_run: bool) -> Self {
        let counters = Counters {
            ran: Duration::ZERO,
            waited: Duration::ZERO,
            slices,
        };
        Self {
            threads: BTreeMap::from([(1, counters.of(wants_to_run))]),
            of: Which::All,
        }
    }

    /// The longest wait of a thread since `before`, which was `wall` ago.
    pub(crate) fn longest_since(&self, before: &Self, wall: Duration) -> Duration {
        let since = |(id, now): (&u32, &Thread)| match before.threads.get(id) {
            // The wait that it is in is added to the counter when it ends.
            Some(then) if now.wants_to_run && now.ran == then.ran => wall,
            Some(then) => now.waited.saturating_sub(then.waited),
            None if before.of == Which::All => now.waited,
            None => Duration::ZERO,
        };
        let each = self.threads.iter().map(since);
        each.max().unwrap_or_default().min(wall)
    }

    /// Has one thread wanted to run all the time since `before`? Then it ran as well, or was not let: had it slept
    /// in between, it would have been let run to wake. That an idle CPU which the machine below holds up has yet to
    /// be told of a thread that was woken counts as waiting here, and is missing in [`Self::longest_since`].
    pub(crate) fn one_never_slept_since(&self, before: &Self) -> bool {
        self.one_since(before, |then, now| then.wants_to_run && now.wants_to_run)
    }

    /// Does one thread want to run that was not let since `before`, whatever it wanted then?
    pub(crate) fn one_is_not_let_since(&self, before: &Self) -> bool {
        self.one_since(before, |_, now| now.wants_to_run)
    }

    fn one_since(&self, before: &Self, has: impl Fn(&Thread, &Thread) -> bool) -> bool {
        self.threads.iter().any(|(id, now)| {
            let then = before.threads.get(id);
            then.is_some_and(|then| then.slices == now.slices && has(then, now))
        })
    }
}

/// The counters of an agent's threads, held open: to read them costs a microsecond each.
#[derive(Debug, Default)]
pub(crate) struct KnownThreads(Vec<(u32, File)>);

impl KnownThreads {
    /// More of them make every question dearer; the first ones are those that answer.
    const MOST: usize = 16;

    /// The threads that these processes have now.
    pub(crate) fn of(processes: &[Pid]) -> Self {
        let mut threads = Vec::new();
        for_each_task(processes, |id, task| {
            if threads.len() < Self::MOST {
                let file = File::open(task.join("schedstat")).ok();
                threads.extend(file.map(|file| (id, file)));
            }
        });
        Self(threads)
    }

    /// Their counters now. Whether one wants to run is not among them.
    pub(crate) fn waits(&self) -> Option<Waits> {
        let mut threads = BTreeMap::new();
        for (id, file) in &self.0 {
            let mut bytes = [0; 128];
            // A thread that has ended waits no more.
            let Ok(count) = file.read_at(&mut bytes, 0) else {
                continue;
            };
            let counters = std::str::from_utf8(&bytes[..count]).ok().and_then(counters);
            threads.extend(counters.map(|counters| (*id, counters.of(false))));
        }
        let of = Which::Known;
        (!threads.is_empty()).then_some(Waits { threads, of })
    }
}

/// Every thread's number and folder. A process or thread that has just ended has none.
fn for_each_task(processes: &[Pid], mut each: impl FnMut(u32, &std::path::Path)) {
    for process in processes {
        let tasks = format!("/proc/{}/task", process.as_raw_nonzero());
        for task in fs::read_dir(tasks).into_iter().flatten().flatten() {
            if let Ok(id) = task.file_name().to_string_lossy().parse() {
                each(id, &task.path());
            }
        }
    }
}

/// What `schedstat` tells: nanoseconds of running and of waiting, and the number of slices.
#[derive(Debug, Clone, Copy)]
struct Counters {
    ran: Duration,
    waited: Duration,
    slices: u64,
}

impl Counters {
    const fn of(self, wants_to_run: bool) -> Thread {
        let Self {
            ran,
            waited,
            slices,
        } = self;
        Thread {
            ran,
            waited,
            slices,
            wants_to_run,
        }
    }
}

fn counters(schedule: &str) -> Option<Counters> {
    let mut numbers = schedule.split_ascii_whitespace().map(str::parse);
    let mut next = || numbers.next()?.ok();
    Some(Counters {
        ran: Duration::from_nanos(next()?),
        waited: Duration::from_nanos(next()?),
        slices: next()?,
    })
}

/// From `schedstat` and `stat` (number, name, state).
fn thread(schedule: &str, status: &str) -> Option<Thread> {
    // The name is the program's, and may hold anything.
    let (_, rest) = status.rsplit_once(')')?;
    Some(counters(schedule)?.of(rest.trim_start().starts_with('R')))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waits(threads: &[(u32, &str, &str)]) -> Waits {
        let of = |&(id, schedule, status)| (id, thread(schedule, status).unwrap());
        Waits {
            threads: threads.iter().map(of).collect(),
            of: Which::All,
        }
    }

    #[test]
    fn only_a_thread_that_wanted_to_run_was_kept_from_it() {
        const WALL: Duration = Duration::from_nanos(1000);
        let before = waits(&[(1, "500 100 3", "1 (a) S 0"), (2, "70 0 1", "2 (b) R 0")]);
        let longest = |threads| waits(threads).longest_since(&before, WALL).as_nanos();
        assert_eq!(longest(&[(1, "500 100 3", "1 (a) S 0")]), 0, "it slept");
        assert_eq!(longest(&[(1, "510 400 4", "1 (a) S 0")]), 300);
        assert_eq!(longest(&[(1, "510 9000 4", "1 (a) S 0")]), 1000);
        assert_eq!(
            longest(&[(2, "70 0 1", "2 (b) R 0")]),
            1000,
            "not once let run"
        );
        assert_eq!(longest(&[(2, "75 20 2", "2 () R) S 0")]), 20);
        assert_eq!(longest(&[(3, "5 40 2", "3 (new) R 0")]), 40);
        assert_eq!(longest(&[]), 0);
    }

    #[test]
    fn who_wants_to_run_at_both_times_and_was_not_let_in_between_did_not_sleep() {
        let then = waits(&[(1, "500 100 3", "1 (a) R 0"), (2, "70 0 1", "2 (b) S 0")]);
        let now = |threads| {
            let now = waits(threads);
            (
                now.one_never_slept_since(&then),
                now.one_is_not_let_since(&then),
            )
        };
        assert_eq!(now(&[(1, "500 100 3", "1 (a) R 0")]), (true, true));
        assert_eq!(
            now(&[(1, "501 100 4", "1 (a) R 0")]),
            (false, false),
            "it was let run, and may have slept"
        );
        assert_eq!(
            now(&[(1, "500 100 3", "1 (a) S 0")]),
            (false, false),
            "it sleeps now"
        );
        assert_eq!(
            now(&[(2, "70 0 1", "2 (b) R 0")]),
            (false, true),
            "it slept then"
        );
        assert_eq!(now(&[(3, "0 0 0", "3 (new) R 0")]), (false, false));
    }

    #[test]
    fn the_kernel_tells_of_this_process() {
        let this = rustix::process::getpid();
        let waits = Waits::read(&[this]).expect("this kernel counts waits");
        assert!(
            waits.threads.values().any(|thread| thread.wants_to_run),
            "this thread runs: {waits:?}"
        );
        assert_eq!(Waits::read(&[]), None);
        let known = KnownThreads::of(&[this]).waits().expect("the same");
        assert!(known.threads.len() <= KnownThreads::MOST);
        assert!(
            known
                .threads
                .keys()
                .all(|id| waits.threads.contains_key(id)),
            "{known:?}"
        );
        assert_eq!(KnownThreads::of(&[]).waits(), None);
    }

    #[test]
    fn of_a_thread_that_was_not_known_nothing_follows() {
        const WALL: Duration = Duration::from_nanos(1000);
        let mut before = waits(&[(1, "500 100 3", "1 (a) S 0")]);
        before.of = Which::Known;
        let now = waits(&[(1, "510 130 4", "1 (a) S 0"), (9, "5 900 2", "9 (b) R 0")]);
        assert_eq!(now.longest_since(&before, WALL).as_nanos(), 30);
    }
}
