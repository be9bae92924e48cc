use crate::latest::Latest;
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

/// Upper bounds, seconds: a smoke run takes seconds, a shard up to minutes, a game many.
const UNITS_S: [f64; 10] = [0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0];
/// Upper bounds, seconds, around the control period of 20 ms that an answer has.
const ANSWERS_S: [f64; 11] = [
    0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.2, 1.0,
];

/// Slots: what they do, how long it takes, and how evenly they keep time.
#[derive(Clone)]
pub struct Slots {
    busy: Gauge,
    units: Family<Ended, Counter>,
    durations: Family<OfWork, Histogram, fn() -> Histogram>,
    episodes: Family<OfTask, Counter>,
    faults: Family<OfTask, Counter>,
    answers: Family<OfTask, Histogram, fn() -> Histogram>,
    round_trips: Family<RoundTrip, Latest>,
    stall: Family<OfSlot, Latest>,
    reruns: Counter,
    still: Gauge,
    standing_still: Arc<Mutex<Vec<String>>>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Ended {
    work: &'static str,
    end: &'static str,
}

/// How a slot was done with a unit of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitEnd {
    /// What came of it is stored.
    Committed,
    /// It is no longer the slot's: given back at the end of the server, cancelled, or its lease ran out.
    Lost,
    /// Given back for a fault of ours.
    PlatformFault,
    /// Given back for want of room on a disk.
    FullDisk,
}

impl UnitEnd {
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
struct OfWork {
    work: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfTask {
    task: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfSlot {
    slot: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RoundTrip {
    slot: String,
    /// `p50`, `p99` or `max`.
    of: &'static str,
}

impl Slots {
    pub(crate) fn new(all: &mut Registry) -> Self {
        let slots = Self {
            busy: Gauge::default(),
            units: Family::default(),
            durations: Family::new_with_constructor(|| Histogram::new(UNITS_S)),
            episodes: Family::default(),
            faults: Family::default(),
            answers: Family::new_with_constructor(|| Histogram::new(ANSWERS_S)),
            round_trips: Family::default(),
            stall: Family::default(),
            reruns: Counter::default(),
            still: Gauge::default(),
            standing_still: Arc::default(),
        };
        all.register(
            "slots_busy",
            "Slots that work on a unit",
            slots.busy.clone(),
        );
        all.register(
            "slots_standing_still",
            "Slots that something holds although their agent was ended",
            slots.still.clone(),
        );
        all.register(
            "units",
            "Units of work that slots were done with, by kind and by how they ended",
            slots.units.clone(),
        );
        all.register_with_unit(
            "unit_duration",
            "From the beginning of a unit of work to its end",
            Unit::Seconds,
            slots.durations.clone(),
        );
        all.register(
            "episodes",
            "Episodes that were played and committed",
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
            "Round trips to an agent that answers at once, of the slot's last shard: what the host adds to every answer",
            Unit::Seconds,
            slots.round_trips.clone(),
        );
        all.register_with_unit(
            "host_stall",
            "The most that the host took of one answer, of the slot's last shard",
            Unit::Seconds,
            slots.stall.clone(),
        );
        all.register(
            "host_noise_reruns",
            "Tries of episodes that were dropped and played again because the host kept an agent from answering",
            slots.reruns.clone(),
        );
        slots
    }

    /// A slot begins a unit; `work` is its kind. Until the guard is gone the slot is busy.
    #[must_use]
    pub fn begin(&self, work: &'static str) -> Busy {
        self.busy.inc();
        Busy {
            slots: self.clone(),
            work,
        }
    }

    /// The slots that something holds although their agent was ended, by the names of their threads.
    pub fn set_standing_still(&self, names: Vec<String>) {
        self.still
            .set(i64::try_from(names.len()).unwrap_or(i64::MAX));
        *self
            .standing_still
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = names;
    }

    /// Those of [`Self::set_standing_still`].
    #[must_use]
    pub fn standing_still(&self) -> Vec<String> {
        let names = self.standing_still.lock();
        names.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// A slot has played episodes, and they are committed.
    pub fn played(&self, slot: &str, outcomes: &[EpisodeOutcome], timing: &SlotTiming) {
        for outcome in outcomes {
            let of_task = OfTask {
                task: outcome.task.as_str(),
            };
            self.episodes.get_or_create(&of_task).inc();
            let faults = self.faults.get_or_create_owned(&of_task);
            faults.inc_by(outcome.fault.is_some().into());
            let answers = self.answers.get_or_create_owned(&of_task);
            answers.observe(outcome.computation_time.mean_s);
        }
        self.reruns.inc_by(timing.host_noise_reruns.into());
        let RoundTrips { p50, p99, max, .. } = timing.before_s.worse(timing.during_s);
        for (of, seconds) in [("p50", p50), ("p99", p99), ("max", max)] {
            let slot = slot.to_owned();
            self.round_trips
                .get_or_create(&RoundTrip { slot, of })
                .set(seconds);
        }
        let slot = slot.to_owned();
        self.stall
            .get_or_create(&OfSlot { slot })
            .set(timing.longest_stall_s);
    }
}

impl fmt::Debug for Slots {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Slots").finish_non_exhaustive()
    }
}

/// A slot that works on a unit.
#[derive(Debug)]
pub struct Busy {
    slots: Slots,
    work: &'static str,
}

impl Busy {
    /// The unit is done with.
    pub fn end(self, end: UnitEnd, took: Duration) {
        let work = self.work;
        let end = end.as_str();
        self.slots.units.get_or_create(&Ended { work, end }).inc();
        self.slots
            .durations
            .get_or_create(&OfWork { work })
            .observe(took.as_secs_f64());
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.slots.busy.dec();
    }
}
