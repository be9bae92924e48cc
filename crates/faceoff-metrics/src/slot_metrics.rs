//! Metrics of slots. A *slot* is a place in a worker that runs one job at a time: a validation run (the check of an upload),
//! a shard (some episodes of an evaluation) or a game.

use crate::declaration::Declare;
use faceoff_types::{EpisodeOutcome, RoundTrips, SlotTiming};
use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, gauge::Gauge, histogram::Histogram},
    registry::{Registry, Unit},
};
use std::{
    fmt,
    sync::{Arc, Mutex, PoisonError, atomic::AtomicU64},
    time::Duration,
};

/// Bucket bounds, seconds: a validation run takes seconds, a shard up to minutes, a game many minutes.
const JOB_DURATION_BUCKETS_S: [f64; 10] =
    [0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0];
/// Bucket bounds, seconds, around the control period of 20 ms.
const ANSWER_TIME_BUCKETS_S: [f64; 11] = [
    0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.2, 1.0,
];

/// A gauge in seconds.
type SecondsGauge = Gauge<f64, AtomicU64>;

/// Metrics of slots: jobs, durations, episodes and timing.
#[derive(Clone)]
pub struct SlotMetrics {
    busy: Gauge,
    jobs: Family<JobEndLabels, Counter>,
    durations: Family<JobLabels, Histogram, fn() -> Histogram>,
    episodes: Family<TaskLabels, Counter>,
    faults: Family<TaskLabels, Counter>,
    answer_times: Family<TaskLabels, Histogram, fn() -> Histogram>,
    /// Round trips to a test agent that answers at once.
    round_trips: Family<RoundTripLabels, SecondsGauge>,
    max_host_interference: Family<SlotLabels, SecondsGauge>,
    /// Episodes that were repeated because of host interference.
    reruns: Counter,
    stuck_count: Gauge,
    /// Names of the stuck slots' threads.
    stuck_names: Arc<Mutex<Vec<String>>>,
}

// The field names of structs with `EncodeLabelSet` are the names of labels.

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct JobEndLabels {
    /// Kind of the job. The label is part of the published metrics, and keeps its name.
    work: &'static str,
    /// How the job ended.
    end: &'static str,
}

/// How a slot's job ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobEnd {
    /// The result is stored.
    Committed,
    /// The slot has lost the job: released at shutdown, cancelled, or the lease expired.
    Lost,
    /// Released after a platform fault.
    PlatformFault,
    /// Released because a disk was full.
    FullDisk,
}

impl JobEnd {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Committed => "committed",
            Self::Lost => "lost",
            Self::PlatformFault => "platform_fault",
            Self::FullDisk => "full_disk",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct JobLabels {
    /// Kind of the job.
    work: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct TaskLabels {
    task: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct SlotLabels {
    slot: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RoundTripLabels {
    slot: String,
    /// The statistic: `p50`, `p99` or `max`.
    of: &'static str,
}

impl SlotMetrics {
    pub(crate) fn new(registry: &mut Registry) -> Self {
        Self {
            busy: registry.declare("slots_busy", "Slots that run a job"),
            stuck_count: registry.declare(
                "slots_standing_still",
                "Slots that are stuck although their agent was ended",
            ),
            jobs: registry.declare("units", "Jobs that slots have ended, by kind and outcome"),
            durations: registry.declare_with_unit(
                "unit_duration",
                "Duration of jobs",
                Unit::Seconds,
                Family::new_with_constructor(|| Histogram::new(JOB_DURATION_BUCKETS_S)),
            ),
            episodes: registry.declare("episodes", "Episodes that were run and committed"),
            faults: registry.declare(
                "agent_faults",
                "Episodes that an agent ended by breaking the protocol or a limit",
            ),
            answer_times: registry.declare_with_unit(
                "agent_answer",
                "Mean time of an agent's answers, of each episode",
                Unit::Seconds,
                Family::new_with_constructor(|| Histogram::new(ANSWER_TIME_BUCKETS_S)),
            ),
            round_trips: registry.declare_with_unit(
                "round_trip",
                "Round trips to an agent that answers at once, of the slot's last shard: the time that the host adds to every answer",
                Unit::Seconds,
                Family::default(),
            ),
            max_host_interference: registry.declare_with_unit(
                "host_stall",
                "Longest delay of one answer by the host, of the slot's last shard",
                Unit::Seconds,
                Family::default(),
            ),
            reruns: registry.declare(
                "host_noise_reruns",
                "Episodes that were repeated because the host kept an agent from answering",
            ),
            stuck_names: Arc::default(),
        }
    }

    /// Records that a slot starts a job. The slot is busy until the guard is dropped.
    #[must_use]
    pub fn start_job(&self, job_kind: &'static str) -> BusySlot {
        self.busy.inc();
        BusySlot {
            metrics: self.clone(),
            job_kind,
        }
    }

    /// Sets the slots that are stuck although their agent was ended. `thread_names` are the names of their threads.
    pub fn set_stuck(&self, thread_names: Vec<String>) {
        self.stuck_count
            .set(i64::try_from(thread_names.len()).unwrap_or(i64::MAX));
        *self
            .stuck_names
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = thread_names;
    }

    /// The names of the stuck slots' threads, from [`Self::set_stuck`].
    #[must_use]
    pub fn stuck(&self) -> Vec<String> {
        let names = self.stuck_names.lock();
        names.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Records the committed episodes of a slot.
    pub fn record_episodes(&self, slot: &str, outcomes: &[EpisodeOutcome], timing: &SlotTiming) {
        for outcome in outcomes {
            let labels = TaskLabels {
                task: outcome.task.to_string(),
            };
            self.episodes.get_or_create(&labels).inc();
            let faults = self.faults.get_or_create_owned(&labels);
            faults.inc_by(outcome.fault.is_some().into());
            let answer_times = self.answer_times.get_or_create_owned(&labels);
            answer_times.observe(outcome.computation_time.mean_s);
        }
        self.reruns.inc_by(timing.host_interference_reruns.into());
        let RoundTrips { p50, p99, max, .. } = timing.before_s.worse(timing.during_s);
        for (of, seconds) in [("p50", p50), ("p99", p99), ("max", max)] {
            let slot = slot.to_owned();
            self.round_trips
                .get_or_create(&RoundTripLabels { slot, of })
                .set(seconds);
        }
        let slot = slot.to_owned();
        self.max_host_interference
            .get_or_create(&SlotLabels { slot })
            .set(timing.max_host_interference_s);
    }
}

impl fmt::Debug for SlotMetrics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SlotMetrics").finish_non_exhaustive()
    }
}

/// Guard of a slot that runs a job.
#[derive(Debug)]
pub struct BusySlot {
    metrics: SlotMetrics,
    job_kind: &'static str,
}

impl BusySlot {
    /// Records the end of the job.
    pub fn end(self, end: JobEnd, duration: Duration) {
        let work = self.job_kind;
        let end = end.as_str();
        self.metrics
            .jobs
            .get_or_create(&JobEndLabels { work, end })
            .inc();
        self.metrics
            .durations
            .get_or_create(&JobLabels { work })
            .observe(duration.as_secs_f64());
    }
}

impl Drop for BusySlot {
    fn drop(&mut self) {
        self.metrics.busy.dec();
    }
}
