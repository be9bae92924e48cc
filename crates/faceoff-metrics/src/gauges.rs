//! Gauges: the state of the server at the moment at which Prometheus reads its metrics. A *slot* is a place in a worker that
//! runs one job at a time.

use Reading::{Count, CountBy, Seconds};
use prometheus_client::{
    encoding::{EncodeMetric, MetricEncoder},
    metrics::MetricType,
    registry::{Registry, Unit},
};
use std::fmt;

/// State of the server when the metrics are read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GaugeValues {
    /// Result of the latest write test.
    pub database_writable: bool,
    pub queue: Queue,
    /// By how many seconds the system clock is ahead since it was set; negative: behind; 0 if it was not set.
    pub clock_step_s: f64,
    /// Evaluations that are queued or running.
    pub open_evaluations: u32,
    /// Slots of this process.
    pub slots: u32,
    /// Slots of remote workers that accept jobs.
    pub remote_slots: u32,
    /// Remote workers that have polled recently.
    pub remote_workers: usize,
    /// Remote jobs that take unusually long.
    pub long_remote_jobs: usize,
    /// The disks that the server writes to.
    pub disks: Vec<Disk>,
    pub process: Process,
}

/// The queue of jobs: validation runs, parts of evaluations, and games.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Queue {
    /// Number of jobs that run in a slot.
    pub running: u32,
    /// Number of jobs that a free slot can start.
    pub waiting: u32,
    /// Number of jobs that have repeatedly run out of disk space, and wait for it.
    pub out_of_space: u32,
    /// Whether no job is started: paused by an organiser, or for lack of disk space.
    pub paused: bool,
    /// Waiting time of the oldest waiting job, seconds; 0 if none is waiting.
    pub oldest_wait_s: f64,
    /// Expected time until all open validation runs, and all open evaluations and games that count, have ended on the current
    /// slots, seconds. NaN if no job of a queued kind was measured yet, or the queue is paused.
    pub expected_s: f64,
}

/// A disk that the server writes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Disk {
    /// Use of the disk: `data` or `scratch`.
    pub name: &'static str,
    pub free_bytes: u64,
    pub size_bytes: u64,
}

/// Resources of this process, as the operating system reports them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Process {
    /// Resident memory.
    pub resident_bytes: u64,
    /// Open file descriptors.
    pub open_fds: u64,
    /// Limit of open file descriptors.
    pub max_fds: u64,
}

/// A published gauge. A unit becomes the last part of its name.
struct Gauge {
    name: &'static str,
    help: &'static str,
    unit: Option<Unit>,
    read: fn(&GaugeValues) -> Reading,
}

/// The value of a gauge.
#[derive(Debug)]
enum Reading {
    Count(u64),
    Seconds(f64),
    /// The name of a label, and a count for each of its values.
    CountBy(&'static str, Vec<(&'static str, u64)>),
}

/// All gauges. Their names, and the names and values of labels, are part of the published metrics.
const GAUGES: [Gauge; 16] = [
    Gauge {
        name: "database_writable",
        help: "1 if the latest write test of the database succeeded",
        unit: None,
        read: |values| Count(values.database_writable.into()),
    },
    Gauge {
        name: "queue_units",
        help: "Jobs: running, waiting, or waiting for disk space",
        unit: None,
        read: |values| jobs(&values.queue),
    },
    Gauge {
        name: "queue_paused",
        help: "1 if no job is started: paused by an organiser, or for lack of disk space",
        unit: None,
        read: |values| Count(values.queue.paused.into()),
    },
    Gauge {
        name: "queue_oldest_wait",
        help: "Waiting time of the oldest waiting job",
        unit: Some(Unit::Seconds),
        read: |values| Seconds(values.queue.oldest_wait_s),
    },
    Gauge {
        name: "queue_expected",
        help: "Expected time until all open validation runs, and all open evaluations and games that count, have ended on the current slots; NaN if it was never measured, or the queue is paused",
        unit: Some(Unit::Seconds),
        read: |values| Seconds(values.queue.expected_s),
    },
    Gauge {
        name: "clock_step",
        help: "By how much the system clock is ahead since it was set (negative: behind); 0 if it was not set",
        unit: Some(Unit::Seconds),
        read: |values| Seconds(values.clock_step_s),
    },
    Gauge {
        name: "evaluations_open",
        help: "Evaluations that are queued or running",
        unit: None,
        read: |values| Count(values.open_evaluations.into()),
    },
    Gauge {
        name: "slots",
        help: "Slots of this process",
        unit: None,
        read: |values| Count(values.slots.into()),
    },
    Gauge {
        name: "remote_slots",
        help: "Slots of remote workers that accept jobs",
        unit: None,
        read: |values| Count(values.remote_slots.into()),
    },
    Gauge {
        name: "remote_workers",
        help: "Remote workers that have polled in the last half minute",
        unit: None,
        read: |values| Count(values.remote_workers as u64),
    },
    Gauge {
        name: "remote_long_units",
        help: "Jobs that a remote worker has been running for more than an hour",
        unit: None,
        read: |values| Count(values.long_remote_jobs as u64),
    },
    Gauge {
        name: "disk_free",
        help: "Free space on the disks that the server writes to",
        unit: Some(Unit::Bytes),
        read: |values| disks(values, |disk| disk.free_bytes),
    },
    Gauge {
        name: "disk_size",
        help: "Size of the disks that the server writes to",
        unit: Some(Unit::Bytes),
        read: |values| disks(values, |disk| disk.size_bytes),
    },
    Gauge {
        name: "process_resident_memory",
        help: "Memory of the server itself, without agents",
        unit: Some(Unit::Bytes),
        read: |values| Count(values.process.resident_bytes),
    },
    Gauge {
        name: "process_open_fds",
        help: "Open file descriptors of the server",
        unit: None,
        read: |values| Count(values.process.open_fds),
    },
    Gauge {
        name: "process_max_fds",
        help: "Limit of open file descriptors",
        unit: None,
        read: |values| Count(values.process.max_fds),
    },
];

fn jobs(queue: &Queue) -> Reading {
    let jobs = [
        ("running", queue.running.into()),
        ("waiting", queue.waiting.into()),
        ("without_room", queue.out_of_space.into()),
    ];
    CountBy("state", jobs.to_vec())
}

fn disks(values: &GaugeValues, bytes: fn(&Disk) -> u64) -> Reading {
    let disks = values.disks.iter();
    CountBy("disk", disks.map(|disk| (disk.name, bytes(disk))).collect())
}

/// A registry of all gauges with these values.
pub(crate) fn registry(prefix: &str, values: &GaugeValues) -> Registry {
    let mut registry = Registry::with_prefix(prefix);
    for gauge in GAUGES {
        let reading = (gauge.read)(values);
        match gauge.unit {
            Some(unit) => registry.register_with_unit(gauge.name, gauge.help, unit, reading),
            None => registry.register(gauge.name, gauge.help, reading),
        }
    }
    registry
}

impl EncodeMetric for Reading {
    fn encode(&self, mut encoder: MetricEncoder<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => encoder.encode_gauge(&clamp_to_i64(*count)),
            Self::Seconds(seconds) => encoder.encode_gauge(seconds),
            Self::CountBy(label, counts) => counts.iter().try_for_each(|(value, count)| {
                encoder
                    .encode_family(&[(*label, *value)])?
                    .encode_gauge(&clamp_to_i64(*count))
            }),
        }
    }

    fn metric_type(&self) -> MetricType {
        MetricType::Gauge
    }

    fn is_empty(&self) -> bool {
        matches!(self, Self::CountBy(_, counts) if counts.is_empty())
    }
}

/// Clamped to the largest gauge value, which also represents “no limit”.
fn clamp_to_i64(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
