use crate::float_gauge::FloatGauge;
use faceoff_types::{EpisodeOutcome, RoundTrips, SlotTiming};
use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, gauge::Gauge, histogram::Histogram},
    registry::{Registry, Unit},
};
use std::{
    fmt,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Bucket bounds, seconds: a validation run takes seconds, a shard up to minutes, a game many minutes.
const JOB_DURATIONS_S: [f64; 10] = [0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0];
/// Bucket bounds, seconds, around the control period of 20 ms.
const ANSWER_TIMES_S: [f64; 11] = [
    0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.2, 1.0,
];

/// Metrics of slots: jobs, durations, episodes and timing.
#[derive(Clone)]
pub struct Slots {
    busy: Gauge,
    jobs: Family<JobEndLabels, Counter>,
    durations: Family<JobLabels, Histogram, fn() -> Histogram>,
    episodes: Family<TaskLabels, Counter>,
    faults: Family<TaskLabels, Counter>,
    answers: Family<TaskLabels, Histogram, fn() -> Histogram>,
    round_trips: Family<RoundTripLabels, FloatGauge>,
    stall: Family<SlotLabels, FloatGauge>,
    reruns: Counter,
    stuck_count: Gauge,
    stuck_names: Arc<Mutex<Vec<String>>>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct JobEndLabels {
    work: &'static str,
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
    work: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct TaskLabels {
    task: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct SlotLabels {
    slot: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RoundTripLabels {
    slot: String,
    /// `p50`, `p99` or `max`.
    of: &'static str,
}

impl Slots {
    pub(crate) fn new(all: &mut Registry) -> Self {
        let slots = Self {
            busy: Gauge::default(),
            jobs: Family::default(),
            durations: Family::new_with_constructor(|| Histogram::new(JOB_DURATIONS_S)),
            episodes: Family::default(),
            faults: Family::default(),
            answers: Family::new_with_constructor(|| Histogram::new(ANSWER_TIMES_S)),
            round_trips: Family::default(),
            stall: Family::default(),
            reruns: Counter::default(),
            stuck_count: Gauge::default(),
            stuck_names: Arc::default(),
        };
        all.register("slots_busy", "Slots that run a job", slots.busy.clone());
        all.register(
            "slots_standing_still",
            "Slots that are stuck although their agent was ended",
            slots.stuck_count.clone(),
        );
        all.register(
            "units",
            "Jobs that slots have ended, by kind and outcome",
            slots.jobs.clone(),
        );
        all.register_with_unit(
            "unit_duration",
            "Duration of jobs",
            Unit::Seconds,
            slots.durations.clone(),
        );
        all.register(
            "episodes",
            "Episodes that were run and committed",
            slots.episodes.clone(),
        );
        all.register(
            "agent_faults",
            "Episodes that an agent ended by breaking the protocol or a limit",
            slots.faults.clone(),
        );
        all.register_with_unit(
            "agent_answer",
            "Mean time of an agent's answers, of each episode",
            Unit::Seconds,
            slots.answers.clone(),
        );
        all.register_with_unit(
            "round_trip",
            "Round trips to an agent that answers at once, of the slot's last shard: the time that the host adds to every answer",
            Unit::Seconds,
            slots.round_trips.clone(),
        );
        all.register_with_unit(
            "host_stall",
            "Longest delay of one answer by the host, of the slot's last shard",
            Unit::Seconds,
            slots.stall.clone(),
        );
        all.register(
            "host_noise_reruns",
            "Episodes that were repeated because the host kept an agent from answering",
            slots.reruns.clone(),
        );
        slots
    }

    /// Records that a slot starts a job of the kind `work`. The slot is busy until the guard is dropped.
    #[must_use]
    pub fn start_job(&self, work: &'static str) -> BusySlot {
        self.busy.inc();
        BusySlot {
            slots: self.clone(),
            work,
        }
    }

    /// Sets the slots that are stuck although their agent was ended, by the names of their threads.
    pub fn set_stuck(&self, names: Vec<String>) {
        self.stuck_count
            .set(i64::try_from(names.len()).unwrap_or(i64::MAX));
        *self
            .stuck_names
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = names;
    }

    /// The slots of [`Self::set_stuck`].
    #[must_use]
    pub fn stuck(&self) -> Vec<String> {
        let names = self.stuck_names.lock();
        names.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Records the committed episodes of a slot.
    pub fn record_episodes(&self, slot: &str, outcomes: &[EpisodeOutcome], timing: &SlotTiming) {
        for outcome in outcomes {
            let labels = TaskLabels {
                task: outcome.task.as_str(),
            };
            self.episodes.get_or_create(&labels).inc();
            let faults = self.faults.get_or_create_owned(&labels);
            faults.inc_by(outcome.fault.is_some().into());
            let answers = self.answers.get_or_create_owned(&labels);
            answers.observe(outcome.computation_time.mean_s);
        }
        self.reruns.inc_by(timing.host_noise_reruns.into());
        let RoundTrips { p50, p99, max, .. } = timing.before_s.worse(timing.during_s);
        for (of, seconds) in [("p50", p50), ("p99", p99), ("max", max)] {
            let slot = slot.to_owned();
            self.round_trips
                .get_or_create(&RoundTripLabels { slot, of })
                .set(seconds);
        }
        let slot = slot.to_owned();
        self.stall
            .get_or_create(&SlotLabels { slot })
            .set(timing.longest_stall_s);
    }
}

impl fmt::Debug for Slots {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Slots").finish_non_exhaustive()
    }
}

/// Guard of a slot that runs a job.
#[derive(Debug)]
pub struct BusySlot {
    slots: Slots,
    work: &'static str,
}

impl BusySlot {
    /// Records the end of the job.
    pub fn end(self, end: JobEnd, took: Duration) {
        let work = self.work;
        let end = end.as_str();
        self.slots
            .jobs
            .get_or_create(&JobEndLabels { work, end })
            .inc();
        self.slots
            .durations
            .get_or_create(&JobLabels { work })
            .observe(took.as_secs_f64());
    }
}

impl Drop for BusySlot {
    fn drop(&mut self) {
        self.slots.busy.dec();
    }
}
