//! Gauges: the state of the server at the moment at which Prometheus reads its metrics. A *slot* is a place in a worker that
//! runs one job at a time.

use crate::float_gauge::FloatGauge;
use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{family::Family, gauge::Gauge},
    registry::{Registry, Unit},
};

/// State of the server when the metrics are read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GaugeValues {
    /// Result of the latest write test.
    pub database_writable: bool,
    pub queue: Queue,
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
    /// Jobs that a slot is running.
    pub running: u32,
    /// Jobs that a slot can start.
    pub waiting: u32,
    /// Jobs that have repeatedly run out of disk space.
    pub out_of_space: u32,
    /// Whether no job is started: paused by an organiser, or for lack of disk space.
    pub paused: bool,
    /// Waiting time of the oldest waiting job, seconds; 0 if none is waiting.
    pub oldest_wait_s: f64,
    /// Expected time until everything that counts is done with the current slots, seconds; NaN if unknown.
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

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StateLabels {
    state: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct DiskLabels {
    disk: &'static str,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Gauges {
    database_writable: Gauge,
    jobs: Family<StateLabels, Gauge>,
    paused: Gauge,
    oldest_wait: FloatGauge,
    expected_time: FloatGauge,
    open_evaluations: Gauge,
    slots: Gauge,
    remote_slots: Gauge,
    remote_workers: Gauge,
    long_remote_jobs: Gauge,
    disk_free: Family<DiskLabels, Gauge>,
    disk_size: Family<DiskLabels, Gauge>,
    resident_memory: Gauge,
    open_fds: Gauge,
    max_fds: Gauge,
}

impl Gauges {
    pub(crate) fn new(registry: &mut Registry) -> Self {
        let gauges = Self::default();
        registry.register(
            "database_writable",
            "1 if the latest write test of the database succeeded",
            gauges.database_writable.clone(),
        );
        registry.register(
            "queue_units",
            "Jobs: running, waiting, or waiting for disk space",
            gauges.jobs.clone(),
        );
        registry.register(
            "queue_paused",
            "1 if no job is started: paused by an organiser, or for lack of disk space",
            gauges.paused.clone(),
        );
        registry.register_with_unit(
            "queue_oldest_wait",
            "Waiting time of the oldest waiting job",
            Unit::Seconds,
            gauges.oldest_wait.clone(),
        );
        registry.register_with_unit(
            "queue_expected",
            "Expected time until everything that counts is done with the current slots; NaN if it was never measured, or the queue is paused",
            Unit::Seconds,
            gauges.expected_time.clone(),
        );
        registry.register(
            "evaluations_open",
            "Evaluations that are queued or running",
            gauges.open_evaluations.clone(),
        );
        registry.register("slots", "Slots of this process", gauges.slots.clone());
        registry.register(
            "remote_slots",
            "Slots of remote workers that accept jobs",
            gauges.remote_slots.clone(),
        );
        registry.register(
            "remote_workers",
            "Remote workers that have polled in the last half minute",
            gauges.remote_workers.clone(),
        );
        registry.register(
            "remote_long_units",
            "Jobs that a remote worker has been running for more than an hour",
            gauges.long_remote_jobs.clone(),
        );
        registry.register_with_unit(
            "disk_free",
            "Free space on the disks that the server writes to",
            Unit::Bytes,
            gauges.disk_free.clone(),
        );
        registry.register_with_unit(
            "disk_size",
            "Size of these disks",
            Unit::Bytes,
            gauges.disk_size.clone(),
        );
        registry.register_with_unit(
            "process_resident_memory",
            "Memory of the server itself, without agents",
            Unit::Bytes,
            gauges.resident_memory.clone(),
        );
        registry.register(
            "process_open_fds",
            "Open file descriptors of the server",
            gauges.open_fds.clone(),
        );
        registry.register(
            "process_max_fds",
            "Limit of open file descriptors",
            gauges.max_fds.clone(),
        );
        gauges
    }

    pub(crate) fn set(&self, values: &GaugeValues) {
        let GaugeValues {
            database_writable,
            queue,
            open_evaluations,
            slots,
            remote_slots,
            remote_workers,
            long_remote_jobs,
            disks,
            process,
        } = values;
        self.database_writable.set((*database_writable).into());
        for (state, count) in [
            ("running", queue.running),
            ("waiting", queue.waiting),
            ("without_room", queue.out_of_space),
        ] {
            self.jobs
                .get_or_create(&StateLabels { state })
                .set(count.into());
        }
        self.paused.set(queue.paused.into());
        self.oldest_wait.set(queue.oldest_wait_s);
        self.expected_time.set(queue.expected_s);
        self.open_evaluations.set((*open_evaluations).into());
        self.slots.set((*slots).into());
        self.remote_slots.set((*remote_slots).into());
        self.remote_workers
            .set(i64::try_from(*remote_workers).unwrap_or(i64::MAX));
        self.long_remote_jobs
            .set(i64::try_from(*long_remote_jobs).unwrap_or(i64::MAX));
        for disk in disks {
            let labels = DiskLabels { disk: disk.name };
            self.disk_free
                .get_or_create(&labels)
                .set(clamp_to_i64(disk.free_bytes));
            self.disk_size
                .get_or_create(&labels)
                .set(clamp_to_i64(disk.size_bytes));
        }
        self.resident_memory
            .set(clamp_to_i64(process.resident_bytes));
        self.open_fds.set(clamp_to_i64(process.open_fds));
        self.max_fds.set(clamp_to_i64(process.max_fds));
    }
}

/// Clamped to the largest gauge value, which also represents “no limit”.
fn clamp_to_i64(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
