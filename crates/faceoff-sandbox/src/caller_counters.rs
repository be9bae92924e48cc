//! Run delay of the calling thread (the evaluator): how long it was runnable and did not run.
//!
//! Of all delays between question and answer, an agent on other CPUs cannot cause this one, with one exception:
//! the thread that reads an agent's log runs on the evaluator's CPUs, as long as the agent writes. Its run time is
//! subtracted.

use crate::{
    cpu_counters::{Ticks, parse_ticks, ticks},
    sched_stat::SchedStat,
};
use std::{cell::RefCell, fs::File, time::Duration};

/// The counters of the calling thread at one time. Only the difference of two readings by the same thread has a
/// meaning.
#[derive(Debug, Clone, Default)]
pub struct CallerCounters {
    waited: Duration,
    /// Run time of the thread that reads the agent's log.
    log_reader_ran: Duration,
    /// Counters of the CPUs that the calling thread may use.
    ticks: Vec<Ticks>,
}

thread_local! {
    /// `None` if the kernel has no such counters.
    static SCHEDULE: RefCell<Option<File>> =
        RefCell::new(File::open("/proc/thread-self/schedstat").ok());
}

impl CallerCounters {
    /// Reads the counters now. `stat` is the content of `/proc/stat`, just read by the caller, because that costs more
    /// than all the rest. `cpus` are those that the thread may use.
    pub(crate) fn read(stat: &str, cpus: &[usize], log_reader_ran: Duration) -> Self {
        Self {
            waited: SCHEDULE
                .with_borrow(|file| file.as_ref().and_then(SchedStat::read))
                .unwrap_or_default()
                .waited,
            log_reader_ran,
            ticks: parse_ticks(stat, cpus).unwrap_or_default(),
        }
    }

    /// Time since `before` in which the thread was runnable and did not run, or the hypervisor had stopped all of its
    /// CPUs. Zero if the host has no such counters.
    #[must_use]
    pub fn run_delay_since(&self, before: &Self) -> Duration {
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
    fn run_delay_behind_another_thread_is_counted() {
        let cpu = affinity::allowed().unwrap()[0];
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            let pinned = scope.spawn(|| {
                affinity::pin_current_thread(&[cpu]).unwrap();
                let read = || CallerCounters::read("", &[], Duration::ZERO);
                let before = read();
                // The other thread never sleeps and uses the same CPU.
                while read().run_delay_since(&before) < Duration::from_millis(20) {}
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
    fn run_time_of_the_log_reader_is_subtracted() {
        let at = |waited_ms, ran_ms| CallerCounters {
            waited: Duration::from_millis(waited_ms),
            log_reader_ran: Duration::from_millis(ran_ms),
            ticks: Vec::new(),
        };
        assert_eq!(
            at(50, 0).run_delay_since(&at(10, 0)),
            Duration::from_millis(40)
        );
        assert_eq!(
            at(50, 35).run_delay_since(&at(10, 5)),
            Duration::from_millis(10)
        );
        assert_eq!(at(50, 95).run_delay_since(&at(10, 5)), Duration::ZERO);
    }

    #[test]
    fn steal_time_counts_only_if_all_cpus_have_it() {
        let stolen = |each: &[u64]| CallerCounters {
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
        assert_eq!(
            stolen(&[4, 7]).run_delay_since(&before),
            Duration::from_millis(20)
        );
        assert_eq!(stolen(&[4, 5]).run_delay_since(&before), Duration::ZERO);
    }
}
