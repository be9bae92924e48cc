//! How long the calling thread itself was kept from running: of what holds up an evaluator between asking and
//! hearing, this alone no agent can bring about on CPUs that are not its own. But for one thing: the thread that reads
//! an agent's log runs on the evaluator's CPUs, as long as the agent writes. What that ran is taken off.

use crate::{
    cpu_counters::{Ticks, ticks, ticks_of},
    sched_stat::SchedStat,
};
use std::{cell::RefCell, fs::File, time::Duration};

/// The counters of the calling thread at one time. Only the difference of two of the same thread says something.
#[derive(Debug, Clone, Default)]
pub struct OwnWait {
    waited: Duration,
    /// What the thread ran that reads the agent's log.
    log_reader_ran: Duration,
    /// Of the CPUs that it may use.
    ticks: Vec<Ticks>,
}

thread_local! {
    /// `None` where the kernel does not tell.
    static SCHEDULE: RefCell<Option<File>> =
        RefCell::new(File::open("/proc/thread-self/schedstat").ok());
}

impl OwnWait {
    /// The counters now, where `/proc/stat` has just been read (that costs more than all the rest); `cpus` are those that
    /// the thread may use.
    pub(crate) fn now(stat: &str, cpus: &[usize], log_reader_ran: Duration) -> Self {
        Self {
            waited: SCHEDULE
                .with_borrow(|file| file.as_ref().and_then(SchedStat::read))
                .unwrap_or_default()
                .waited,
            log_reader_ran,
            ticks: ticks_of(stat, cpus).unwrap_or_default(),
        }
    }

    /// For how long the thread wanted to run since `before` and was not let, or the machine below this one held up all
    /// of its CPUs; zero where the host does not tell.
    #[must_use]
    pub fn since(&self, before: &Self) -> Duration {
        let each = std::iter::zip(&before.ticks, &self.ticks);
        let stolen = each.map(|(before, now)| now.stolen.saturating_sub(before.stolen));
        let log_reader_ran = self.log_reader_ran.saturating_sub(before.log_reader_ran);
        self.waited
            .saturating_sub(before.waited)
            .saturating_sub(log_reader_ran)
            + ticks(stolen.min().unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affinity;
    use std::{
        sync::atomic::{AtomicBool, Ordering},
        thread,
    };

    #[test]
    fn a_wait_behind_another_thread_is_counted_and_sleep_is_not() {
        let cpu = affinity::allowed().unwrap()[0];
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            let pinned = scope.spawn(|| {
                affinity::pin_current_thread(&[cpu]).unwrap();
                let now = || OwnWait::now("", &[], Duration::ZERO);
                let before = now();
                // With another thread that never sleeps on the same CPU.
                while now().since(&before) < Duration::from_millis(20) {}
                over.store(true, Ordering::Relaxed);
            });
            scope.spawn(|| {
                affinity::pin_current_thread(&[cpu]).unwrap();
                while !over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
            pinned.join().unwrap();
        });
    }

    #[test]
    fn time_of_the_logs_reader_is_no_excuse() {
        let at = |waited_ms, ran_ms| OwnWait {
            waited: Duration::from_millis(waited_ms),
            log_reader_ran: Duration::from_millis(ran_ms),
            ticks: Vec::new(),
        };
        assert_eq!(at(50, 0).since(&at(10, 0)), Duration::from_millis(40));
        assert_eq!(at(50, 35).since(&at(10, 5)), Duration::from_millis(10));
        assert_eq!(at(50, 95).since(&at(10, 5)), Duration::ZERO);
    }

    #[test]
    fn only_what_was_stolen_of_all_cpus_held_it_up() {
        let stolen = |each: &[u64]| OwnWait {
            waited: Duration::ZERO,
            log_reader_ran: Duration::ZERO,
            ticks: each
                .iter()
                .map(|stolen| Ticks {
                    stolen: *stolen,
                    ..Ticks::default()
                })
                .collect(),
        };
        let before = stolen(&[1, 5]);
        assert_eq!(stolen(&[4, 7]).since(&before), Duration::from_millis(20));
        assert_eq!(stolen(&[4, 5]).since(&before), Duration::ZERO);
    }
}
