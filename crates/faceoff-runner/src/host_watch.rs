//! Was the host itself asleep? A thread on each CPU that matters wakes every few milliseconds and
//! looks how late it is. When it is late, no ordinary process on that CPU was served either: the
//! virtual machine was held up, a process of higher priority took the CPU, or this service was
//! stopped. An agent that sleeps or waits delays nobody, so that leaves no trace here.

use crate::fault::PlatformFault;
use faceoff_sandbox::affinity::pin_current_thread;
use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// How often a watched CPU is asked for a sign of life: often enough for a limit of 20 ms, seldom
/// enough (250 wake-ups a second) not to be felt.
const BEAT: Duration = Duration::from_millis(4);
/// A beat that is late by no more than this is ordinary scheduling, no stall.
const TOLERANCE: Duration = Duration::from_millis(4);
/// Stalls that are remembered; older ones concern no step that is still open.
const REMEMBERED: usize = 1024;

/// Tells whether the host stalled.
pub trait HostWatch: Sync {
    /// For how much of the time between two instants a CPU of agent or simulator did nothing, in
    /// seconds.
    fn stalled_s(&self, from: Instant, to: Instant) -> f64;

    /// The longest stall so far, in seconds.
    fn longest_stall_s(&self) -> f64 {
        0.0
    }
}

/// Threads that watch the agent's CPUs, one each, and one for those of the calling thread. They end
/// with it.
#[derive(Debug)]
pub(crate) struct StallWatch {
    shared: Arc<Shared>,
    watchers: Vec<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    begun: Instant,
    stop: AtomicBool,
    stalls: Mutex<VecDeque<(Instant, Instant)>>,
    longest_ns: AtomicU64,
    /// The last sign of life of each watcher, in nanoseconds after `begun`.
    last_beat_ns: Vec<AtomicU64>,
}

impl StallWatch {
    /// Starts to watch. The thread for the simulator inherits the CPUs of the calling thread.
    ///
    /// # Errors
    /// When a thread cannot be started.
    pub fn start(agent_cpus: &[usize]) -> Result<Self, PlatformFault> {
        let mut places: Vec<Option<usize>> = agent_cpus.iter().copied().map(Some).collect();
        places.push(None);
        let begun = Instant::now();
        let mut watch = Self {
            shared: Arc::new(Shared {
                begun,
                stop: AtomicBool::new(false),
                stalls: Mutex::default(),
                longest_ns: AtomicU64::new(0),
                last_beat_ns: places.iter().map(|_| AtomicU64::new(0)).collect(),
            }),
            watchers: Vec::with_capacity(places.len()),
        };
        for (index, cpu) in places.into_iter().enumerate() {
            let shared = Arc::clone(&watch.shared);
            let watcher = thread::Builder::new()
                .name("host-watch".to_owned())
                .spawn(move || {
                    if let Some(cpu) = cpu {
                        pin(cpu);
                    }
                    shared.watch(index);
                })
                .map_err(PlatformFault::io("starting a thread that watches the host"))?;
            watch.watchers.push(watcher);
        }
        Ok(watch)
    }
}

impl HostWatch for StallWatch {
    fn stalled_s(&self, from: Instant, to: Instant) -> f64 {
        self.shared.stalled(from, to, Instant::now()).as_secs_f64()
    }

    fn longest_stall_s(&self) -> f64 {
        self.shared.longest(Instant::now()).as_secs_f64()
    }
}

impl Drop for StallWatch {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        for watcher in &self.watchers {
            watcher.thread().unpark();
        }
        for watcher in self.watchers.drain(..) {
            if watcher.join().is_err() {
                tracing::error!("a thread that watched the host panicked");
            }
        }
    }
}

impl Shared {
    fn watch(&self, index: usize) {
        let mut last = Instant::now();
        self.beat(index, last);
        while !self.stop.load(Ordering::Relaxed) {
            thread::park_timeout(BEAT);
            let now = Instant::now();
            self.woke(index, last, now);
            last = now;
        }
    }

    /// A watcher woke at `now`; the last time was `last`.
    fn woke(&self, index: usize, last: Instant, now: Instant) {
        if is_stall(last, now) {
            let mut stalls = self.stalls.lock().unwrap_or_else(PoisonError::into_inner);
            if stalls.len() == REMEMBERED {
                stalls.pop_front();
            }
            stalls.push_back((last, now));
            self.longest_ns
                .fetch_max(nanoseconds(now - last), Ordering::Relaxed);
        }
        self.beat(index, now);
    }

    fn beat(&self, index: usize, now: Instant) {
        let since = nanoseconds(now.saturating_duration_since(self.begun));
        self.last_beat_ns[index].store(since, Ordering::Release);
    }

    /// How much of `from` to `to` lies within stalls, those included that go on until `now`.
    fn stalled(&self, from: Instant, to: Instant, now: Instant) -> Duration {
        // A watcher notes a stall before it beats: looked at in the other order, none is missed.
        let mut spans: Vec<_> = self.going_on(now).collect();
        spans.extend(
            self.stalls
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .iter(),
        );
        covered(spans, from, to)
    }

    /// The longest stall until `now`.
    fn longest(&self, now: Instant) -> Duration {
        let going_on = self.going_on(now).map(|(from, to)| to - from).max();
        let over = Duration::from_nanos(self.longest_ns.load(Ordering::Relaxed));
        over.max(going_on.unwrap_or_default())
    }

    /// Stalls that are not over `now`, of which their watchers know nothing yet.
    fn going_on(&self, now: Instant) -> impl Iterator<Item = (Instant, Instant)> {
        self.last_beat_ns
            .iter()
            .map(|beat| self.begun + Duration::from_nanos(beat.load(Ordering::Acquire)))
            .filter(move |beat| is_stall(*beat, now))
            .map(move |beat| (beat, now))
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

fn is_stall(last: Instant, now: Instant) -> bool {
    now.saturating_duration_since(last) > BEAT + TOLERANCE
}

/// How much of `from` to `to` the spans cover together; they may overlap.
fn covered(mut spans: Vec<(Instant, Instant)>, from: Instant, to: Instant) -> Duration {
    spans.sort_unstable();
    let mut covered = Duration::ZERO;
    let mut reached = from;
    for (start, end) in spans {
        let (start, end) = (start.max(reached), end.min(to));
        if start < end {
            covered += end - start;
            reached = end;
        }
    }
    covered
}

/// Best effort: an unpinned watcher sees only stalls of the whole machine, and blames the host less.
fn pin(cpu: usize) {
    if let Err(error) = pin_current_thread(&[cpu]) {
        tracing::warn!(%error, cpu, "the thread that watches a CPU cannot be pinned to it");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_that_overlap_count_once_and_only_within_the_question() {
        let at = |ms| Instant::now() + Duration::from_secs(1) + Duration::from_millis(ms);
        let base = at(0);
        let at = |ms| base + Duration::from_millis(ms);
        let spans = vec![
            (at(30), at(60)),
            (at(0), at(20)),
            (at(10), at(40)),
            (at(90), at(200)),
        ];
        let covered = |from, to| covered(spans.clone(), at(from), at(to)).as_millis();
        assert_eq!(covered(0, 100), 70);
        assert_eq!(covered(15, 35), 20);
        assert_eq!(covered(60, 90), 0);
        assert_eq!(covered(100, 150), 50);
    }

    /// One watcher that beat last `ms` milliseconds after `begun`.
    fn beat_at(begun: Instant, ms: u64) -> Shared {
        Shared {
            begun,
            stop: AtomicBool::new(false),
            stalls: Mutex::default(),
            longest_ns: AtomicU64::new(0),
            last_beat_ns: vec![AtomicU64::new(ms * 1_000_000)],
        }
    }

    #[test]
    fn a_stall_that_is_not_over_counts_until_now_and_an_ordinary_pause_does_not() {
        let begun = Instant::now();
        let shared = beat_at(begun, 5);
        let at = |ms| begun + Duration::from_millis(ms);
        assert_eq!(shared.stalled(at(6), at(12), at(12)), Duration::ZERO);
        assert_eq!(shared.longest(at(12)), Duration::ZERO);
        assert_eq!(
            shared.stalled(at(10), at(40), at(45)),
            Duration::from_millis(30)
        );
        assert_eq!(shared.longest(at(45)), Duration::from_millis(40));
    }

    #[test]
    fn a_wait_through_which_the_watchers_wake_on_time_is_no_stall() {
        let begun = Instant::now();
        let shared = beat_at(begun, 0);
        let at = |ms| begun + Duration::from_millis(ms);
        for ms in (0..2000).step_by(8) {
            shared.woke(0, at(ms), at(ms + 8));
        }
        assert_eq!(shared.stalled(at(100), at(1900), at(2000)), Duration::ZERO);
        assert_eq!(shared.longest(at(2000)), Duration::ZERO);
        shared.woke(0, at(2000), at(2150));
        assert_eq!(
            shared.stalled(at(100), at(2100), at(2150)),
            Duration::from_millis(100)
        );
    }

    /// Stops its parent, for 0.15 s from when each of its threads is seen to stand still.
    const STOPS_ITS_PARENT: &str = "\
import os, signal, time
parent = os.getppid()
def stands(thread):
    try: return open(f'/proc/{parent}/task/{thread}/stat').read().rpartition(')')[2].split()[0] == 'T'
    except OSError: return True
os.kill(parent, signal.SIGSTOP)
while not all(map(stands, os.listdir(f'/proc/{parent}/task'))): time.sleep(0.001)
time.sleep(0.15)
os.kill(parent, signal.SIGCONT)
";

    #[test]
    fn a_process_that_really_stands_still_is_seen() {
        let watch = StallWatch::start(&[]).unwrap();
        let from = Instant::now();
        let stopped = std::process::Command::new("python3")
            .args(["-c", STOPS_ITS_PARENT])
            .status()
            .unwrap();
        assert!(stopped.success());
        let seen_s = watch.stalled_s(from, Instant::now());
        assert!(seen_s >= 0.15, "{seen_s}");
        assert!(watch.longest_stall_s() >= 0.15);
    }
}
