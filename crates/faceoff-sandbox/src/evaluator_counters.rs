//! Run delay of the calling thread (the evaluator): how long it was runnable and did not run.
//!
//! An agent on other CPUs cannot cause this delay between question and answer, with one exception: the thread that reads the agent's
//! log runs on the evaluator's CPUs, as long as the agent writes. The run time of that thread is subtracted.

use crate::{
    cpu_counters::{Ticks, parse_ticks, ticks_to_duration},
    sched_stat::SchedStat,
};
use std::{cell::RefCell, fs::File, time::Duration};

/// The counters of the calling thread at one time. Only the difference of two readings by the same thread has a
/// meaning.
#[derive(Debug, Clone, Default)]
pub struct EvaluatorCounters {
    wait_time: Duration,
    /// Run time of the thread that reads the agent's log.
    log_reader_run_time: Duration,
    /// Counters of the CPUs that the calling thread may use.
    ticks: Vec<Ticks>,
}

thread_local! {
    /// `None` if the kernel has no such counters.
    static SCHEDSTAT_FILE: RefCell<Option<File>> =
        RefCell::new(File::open("/proc/thread-self/schedstat").ok());
}

impl EvaluatorCounters {
    /// Reads the counters now. `stat` is the content of `/proc/stat`, just read by the caller, because reading it costs more than
    /// all the rest. `cpus` are the CPUs that the thread may use.
    pub(crate) fn read(stat: &str, cpus: &[usize], log_reader_run_time: Duration) -> Self {
        Self {
            wait_time: SCHEDSTAT_FILE
                .with_borrow(|file| file.as_ref().and_then(SchedStat::read))
                .unwrap_or_default()
                .wait_time,
            log_reader_run_time,
            ticks: parse_ticks(stat, cpus).unwrap_or_default(),
        }
    }

    /// Time since `earlier` in which the thread was runnable and did not run, or the hypervisor had stopped all of its
    /// CPUs. Zero if the host has no such counters.
    #[must_use]
    pub fn run_delay_since(&self, earlier: &Self) -> Duration {
        let each = std::iter::zip(&earlier.ticks, &self.ticks);
        let stolen = each.map(|(earlier, now)| now.stolen.saturating_sub(earlier.stolen));
        let log_reader_run_time = self
            .log_reader_run_time
            .saturating_sub(earlier.log_reader_run_time);
        self.wait_time
            .saturating_sub(earlier.wait_time)
            .saturating_sub(log_reader_run_time)
            + ticks_to_duration(stolen.min().unwrap_or_default())
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
        let cpu = affinity::allowed_cpus().unwrap()[0];
        let is_done = AtomicBool::new(false);
        thread::scope(|scope| {
            let pinned = scope.spawn(|| {
                affinity::pin_current_thread(&[cpu]).unwrap();
                let read = || EvaluatorCounters::read("", &[], Duration::ZERO);
                let earlier = read();
                // The other thread never sleeps and uses the same CPU.
                while read().run_delay_since(&earlier) < Duration::from_millis(20) {}
                is_done.store(true, Ordering::Relaxed);
            });
            scope.spawn(|| {
                affinity::pin_current_thread(&[cpu]).unwrap();
                while !is_done.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
            pinned.join().unwrap();
        });
    }

    #[test]
    fn run_time_of_the_log_reader_is_subtracted() {
        let counters = |waited_ms, ran_ms| EvaluatorCounters {
            wait_time: Duration::from_millis(waited_ms),
            log_reader_run_time: Duration::from_millis(ran_ms),
            ticks: Vec::new(),
        };
        assert_eq!(
            counters(50, 0).run_delay_since(&counters(10, 0)),
            Duration::from_millis(40)
        );
        assert_eq!(
            counters(50, 35).run_delay_since(&counters(10, 5)),
            Duration::from_millis(10)
        );
        assert_eq!(
            counters(50, 95).run_delay_since(&counters(10, 5)),
            Duration::ZERO
        );
    }

    #[test]
    fn steal_time_counts_only_if_all_cpus_have_it() {
        let with_steal_ticks = |each: &[u64]| EvaluatorCounters {
            wait_time: Duration::ZERO,
            log_reader_run_time: Duration::ZERO,
            ticks: each
                .iter()
                .map(|stolen| Ticks {
                    stolen: *stolen,
                    ..Ticks::default()
                })
                .collect(),
        };
        let earlier = with_steal_ticks(&[1, 5]);
        assert_eq!(
            with_steal_ticks(&[4, 7]).run_delay_since(&earlier),
            Duration::from_millis(20)
        );
        assert_eq!(
            with_steal_ticks(&[4, 5]).run_delay_since(&earlier),
            Duration::ZERO
        );
    }
}
