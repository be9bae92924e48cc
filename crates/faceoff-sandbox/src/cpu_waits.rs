//! How long the threads of an agent wanted to run and were not let: who sleeps is not kept from anything
//! by what others run meanwhile.

use rustix::process::Pid;
use std::{collections::BTreeMap, fs, time::Duration};

/// Of each thread, at one time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Waits(BTreeMap<u32, Thread>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Thread {
    ran: Duration,
    /// Up to when it was last let run.
    waited: Duration,
    /// It runs or waits to run now.
    wants_to_run: bool,
}

impl Waits {
    /// What the kernel tells of all threads of these processes; `None` if it tells nothing at all, as one
    /// does that was built without that.
    pub(crate) fn read(processes: &[Pid]) -> Option<Self> {
        let mut waits = BTreeMap::new();
        for process in processes {
            let tasks = format!("/proc/{}/task", process.as_raw_nonzero());
            // A process or thread that has just ended has no file: it waits no more.
            for task in fs::read_dir(tasks).into_iter().flatten().flatten() {
                let of = |file| fs::read_to_string(task.path().join(file)).ok();
                let id = task.file_name().to_string_lossy().parse();
                if let (Ok(id), Some(schedule), Some(status)) = (id, of("schedstat"), of("stat")) {
                    waits.extend(thread(&schedule, &status).map(|thread| (id, thread)));
                }
            }
        }
        (!waits.is_empty()).then_some(Self(waits))
    }

    /// The longest wait of a thread since `before`, which was `wall` ago.
    pub(crate) fn longest_since(&self, before: &Self, wall: Duration) -> Duration {
        let since = |(id, now): (&u32, &Thread)| match before.0.get(id) {
            // The wait that it is in is added to the counter when it ends.
            Some(then) if now.wants_to_run && now.ran == then.ran => wall,
            Some(then) => now.waited.saturating_sub(then.waited),
            None => now.waited,
        };
        self.0.iter().map(since).max().unwrap_or_default().min(wall)
    }
}

/// From `schedstat` (nanoseconds of running and of waiting, slices) and `stat` (number, name, state).
fn thread(schedule: &str, status: &str) -> Option<Thread> {
    let mut numbers = schedule.split_ascii_whitespace().map(str::parse);
    let mut next = || Some(Duration::from_nanos(numbers.next()?.ok()?));
    // The name is the program's, and may hold anything.
    let (_, rest) = status.rsplit_once(')')?;
    Some(Thread {
        ran: next()?,
        waited: next()?,
        wants_to_run: rest.trim_start().starts_with('R'),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waits(threads: &[(u32, &str, &str)]) -> Waits {
        let of = |&(id, schedule, status)| (id, thread(schedule, status).unwrap());
        Waits(threads.iter().map(of).collect())
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
    fn the_kernel_tells_of_this_process() {
        let this = rustix::process::getpid();
        let waits = Waits::read(&[this]).expect("this kernel counts waits");
        assert!(
            waits.0.values().any(|thread| thread.wants_to_run),
            "this thread runs: {waits:?}"
        );
        assert_eq!(Waits::read(&[]), None);
    }
}
